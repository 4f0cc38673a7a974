/* Memory runs out at the n-th allocation of our own code, for every n, while something is created
 * or read: an error that says so each time, nothing leaked. The linker wraps the allocator
 * (tests/CMakeLists.txt), so this runs under the address sanitizer too; what MuJoCo and oneDNN
 * allocate inside is theirs. */
#include <pthread.h>
#include <unistd.h>

#include "control/controller.h"
#include "env/actuator/fit.h"
#include "identify/fit_csv.h"
#include "kit.h"
#include "mild/map.h"
#include "run/train/trainer.h"
#include "sa01.h"
#include "unnamed_file.h"

#define MODEL SA01
#define POLICY MILD_SOURCE_DIR "/policies/mild.safetensors"

enum { LIVE_MAX = 4096 };

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static void *live[LIVE_MAX];         /* blocks that our code allocated and has not freed */
static int live_count, fail_at = -1; /* allocations until the one that fails; negative: none */

WRAPS(malloc);
WRAPS(calloc);
WRAPS(realloc);
WRAPS(aligned_alloc);
WRAPS(free);

static int fails(void) {
    pthread_mutex_lock(&lock);
    int now = fail_at == 0;
    fail_at -= fail_at >= 0;
    pthread_mutex_unlock(&lock);
    return now;
}

static void *take(void *block) {
    pthread_mutex_lock(&lock);
    if (block && live_count < LIVE_MAX) {
        live[live_count++] = block;
    }
    pthread_mutex_unlock(&lock);
    return block;
}

static void give(void *block) {
    pthread_mutex_lock(&lock);
    int i = live_count - 1;
    while (i >= 0 && live[i] != block) {
        i--;
    }
    if (i >= 0) {
        live[i] = live[--live_count];
    }
    pthread_mutex_unlock(&lock);
}

void *__wrap_malloc(size_t size) {
    return fails() ? NULL : take(__real_malloc(size));
}

void *__wrap_calloc(size_t count, size_t size) {
    return fails() ? NULL : take(__real_calloc(count, size));
}

void *__wrap_aligned_alloc(size_t alignment, size_t size) {
    return fails() ? NULL : take(__real_aligned_alloc(alignment, size));
}

void *__wrap_realloc(void *block, size_t size) {
    if (fails()) {
        return NULL;
    }
    give(block);
    return take(__real_realloc(block, size));
}

void __wrap_free(void *block) {
    give(block);
    __real_free(block);
}

/* What is created: true when it was, and destroyed again; otherwise *error says why. */
typedef int (*Attempt)(MildError *error);

static MildSoleDef plate_def(void) {
    static const double box[8] = {0, 0, 0.1, 0, 0.1, 0.1, 0, 0.1};
    return (MildSoleDef){box, 4, 0.02, -0.05, 20};
}

static int attempt_sole(MildError *error) {
    MildSoleDef def = plate_def();
    MildSole *sole = mild_sole_create(&def, error),
             *middle = sole ? mild_sole_concentric(sole, error) : NULL;
    const MildSole *soles[2] = {sole, middle};
    MildScratch *scratch = middle ? mild_scratch_create(soles, 2, error) : NULL;
    int made = scratch != NULL;
    mild_scratch_destroy(scratch);
    mild_sole_destroy(middle);
    mild_sole_destroy(sole);
    return made;
}

static int attempt_map(MildError *error) {
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_ROUGH;
    def.cell = 0.1;
    def.patches = MILD_PATTERN_CHECKER;
    MildMap *map = mild_map_create(&def, error);
    mild_map_destroy(map);
    return map != NULL;
}

static int attempt_robot(MildError *error) {
    Robot *robot = robot_create(MODEL, error);
    RobotSim *sim = robot ? robot_sim_create(robot, 0.002, error) : NULL;
    int made = sim != NULL;
    robot_sim_destroy(sim);
    robot_destroy(robot);
    return made;
}

static Robot *walker;

static int make_walker(void **state) {
    (void)state;
    walker = robot_create(MODEL, NULL);
    return walker == NULL;
}

static int drop_walker(void **state) {
    (void)state;
    robot_destroy(walker);
    return 0;
}

static int attempt_controller(MildError *error) {
    Controller controller = {0};
    int made = controller_learned(POLICY, walker, NULL, 1, &controller, error) == MILD_OK;
    controller_destroy(&controller);
    return made;
}

static int attempt_passivity(MildError *error) {
    const TaskDef task = task_def_default();
    const ControllerDef def = {NULL, &task, walker, NULL, 2};
    Controller controller = {0};
    int made = controller_make("passivity", &def, &controller, error) == MILD_OK;
    controller_destroy(&controller);
    return made;
}

/* A log of 11 s and its network. */
static int attempt_actuator(MildError *error) {
    char *text = NULL;
    size_t size;
    double zero[SA01_JOINTS] = {0};
    FILE *csv = open_memstream(&text, &size);
    assert_non_null(csv);
    record_print_header(walker, csv);
    for (int row = 0; row < 1100; row++) {
        record_print_row(SA01_JOINTS, 0.01 * row, zero, zero, zero, csv);
    }
    fclose(csv);
    const char *log = unnamed_file(text, size);
    Record record = {.robot = walker};
    const ActuatorFitDef def = {.spacing = 0.01, .steps = 1};
    ActuatorScore score[SA01_JOINTS];
    Pool *pool = pool_create(1);
    Actuator *actuator = NULL;
    if (!pool) {
        mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
    } else if (record_read(&record, log, error) == MILD_OK) {
        actuator = actuator_fit(&def, &record, pool, score, error);
    }
    int made = actuator != NULL;
    actuator_destroy(actuator);
    pool_destroy(pool);
    record_free(&record);
    free(text);
    return made;
}

static int attempt_record(MildError *error) {
    char text[2000] = "depth_m,force_n\n";
    for (int i = 0; i < 40; i++) {
        snprintf(text + strlen(text), 30, "%g,%g\n", 1e-3 * i, 5.0 * i);
    }
    FitFile record;
    const int made = fit_csv_read(unnamed_file(text, strlen(text)), &record, error) == MILD_OK;
    fit_file_close(&record);
    return made;
}

static int attempt_trainer(MildError *error) {
    ExperimentDef def = experiment_def_default();
    def.train.envs = 4;
    def.train.threads = 2;
    def.ppo.steps = 4;
    def.ppo.minibatches = 1;
    Trainer *trainer = train_create(&def, error);
    train_destroy(trainer);
    return trainer != NULL;
}

/* With the 1st, 2nd, ... allocation failing, until one attempt meets no failure. */
static void fail_each(const char *name, Attempt attempt) {
    int met = 1, n = 0;
    MildError first = {0};
    assert_true(attempt(&first)); /* what is allocated once and kept, and that it works at all */
    for (; met; n++) {
        MildError error = {0};
        int before = live_count;
        fail_at = n;
        int made = attempt(&error);
        met = fail_at < 0;
        fail_at = -1;
        if (live_count != before) {
            fail_msg("%s: allocation %d failing leaks %d blocks", name, n, live_count - before);
        }
        if (made == met) {
            fail_msg("%s: allocation %d failing: %s", name, n,
                     made ? "created all the same" : error.text);
        }
        if (!made && (error.status != MILD_ERROR_MEMORY || !error.text[0])) {
            fail_msg("%s: allocation %d failing says: '%s' (%d)", name, n, error.text,
                     (int)error.status);
        }
    }
    print_message("%-10s %3d allocations, each failed once\n", name, n - 1);
}

TEST(test_every_allocation_may_fail) {
    fail_each("sole", attempt_sole);
    fail_each("map", attempt_map);
    fail_each("record", attempt_record);
    fail_each("robot", attempt_robot);
    fail_each("policy", attempt_controller);
    MildError none = {0};
    if (controller_check("passivity", &none) == MILD_OK) { /* the lab is built */
        fail_each("passivity", attempt_passivity);
    }
    fail_each("actuator", attempt_actuator);
    fail_each("trainer", attempt_trainer);
}

TEST_MAIN(make_walker, drop_walker)
