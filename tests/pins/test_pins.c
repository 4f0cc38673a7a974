/* Every number of a press, of rollouts and of two small trainings against what tests/pins.txt says
 * they were. Whoever changes a result on purpose renews that file: scripts/pin.sh "reason". */
#include <gnu/libc-version.h>
#include <math.h>
#include <mujoco/mujoco.h>
#include <oneapi/dnnl/dnnl.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "envs_kit.h"
#include "identify/press.h"
#include "learn/toy.h"
#include "materials.h"
#include "run/train/trainer.h"
#include "task/task_kit.h"

/* ---- what pins are ---- */

/* Pinned numbers: tests/pins.txt holds what this tree computed when it was last right, and this
 * reads it. A hash holds on one platform, to the last bit; a plain number holds on every platform,
 * within a tolerance. */

/* What else than compiler and processor the last bit depends on. */
enum { PIN_ON_MUJOCO = 1, PIN_ON_ONEDNN = 2 };

#define PIN_FILE MILD_SOURCE_DIR "/tests/pins.txt"
#define PIN_RENEW "if that is meant: scripts/pin.sh \"reason\""

enum { PLATFORM_SIZE = 256 };

static int compared, missing, wrong;
static double worst; /* difference of pin_near as a share of its tolerance */
static char worst_name[128];
static FILE *rows;

#if defined(__clang__)
#define COMPILER "clang-" __clang_version__
#else
#define COMPILER "gcc-" __VERSION__
#endif

#if defined(__AVX512F__)
#define VECTORS "avx512"
#elif defined(__AVX2__)
#define VECTORS "avx2"
#elif defined(__ARM_NEON)
#define VECTORS "neon"
#else
#define VECTORS "128"
#endif

#if defined(__FMA__) || defined(__ARM_FEATURE_FMA)
#define FUSED "+fma"
#else
#define FUSED ""
#endif

#if defined(__OPTIMIZE__)
#define UNUSUAL ""
#else
#define UNUSUAL "/unoptimised" /* sums stay in order there */
#endif

/* Compiler, processor that it compiles for, vectors, mathematical library; then the others. The
 * MuJoCo and oneDNN that are loaded, not those compiled against. */
static void platform_name(unsigned depends_on, char name[PLATFORM_SIZE]) {
    int used = snprintf(name, PLATFORM_SIZE, "%s", COMPILER);
    name[strcspn(name, " ")] = '\0'; /* "14.0.6 (vendor ...)" */
    used = (int)strlen(name);
    used +=
        snprintf(name + used, (size_t)(PLATFORM_SIZE - used),
                 "/%s/" VECTORS FUSED UNUSUAL "/glibc-%s", PIN_PROCESSOR, gnu_get_libc_version());
    if (depends_on & PIN_ON_MUJOCO) {
        used +=
            snprintf(name + used, (size_t)(PLATFORM_SIZE - used), "/mujoco-%s", mj_versionString());
    }
    if (depends_on & PIN_ON_ONEDNN) {
        const dnnl_version_t *version = dnnl_version();
        snprintf(name + used, (size_t)(PLATFORM_SIZE - used), "/onednn-%d.%d.%d-isa%x",
                 version->major, version->minor, version->patch,
                 (unsigned)dnnl_get_effective_cpu_isa());
    }
}

/* FNV-1a (Fowler, Noll and Vo) of `size` bytes, continued from `hash`. */
#define PIN_HASH_START 0xcbf29ce484222325u
static uint64_t pin_hash(uint64_t hash, const void *data, size_t size) {
    const unsigned char *bytes = data;
    for (size_t i = 0; i < size; i++) {
        hash = (hash ^ bytes[i]) * 0x100000001b3u;
    }
    return hash;
}

/* Writes the row when rows are asked for. */
static int row_written(const char *platform, const char *name, const char *value) {
    const char *path = getenv("PIN_ROWS");
    if (!path) {
        return 0;
    }
    rows = rows ? rows : fopen(path, "w");
    if (!rows) {
        fprintf(stderr, "PIN_ROWS=%s cannot be written\n", path);
        exit(2);
    }
    fprintf(rows, "%s %s %s\n", platform, name, value);
    return 1;
}

/* The value of a row, or 0. */
static int row_find(const char *platform, const char *name, char value[64]) {
    FILE *file = fopen(PIN_FILE, "r");
    char line[512], row_platform[PLATFORM_SIZE], row_name[128];
    int found = 0;
    while (file && !found && fgets(line, sizeof line, file)) {
        found = line[0] != '#' &&
                sscanf(line, "%255s %127s %63s", row_platform, row_name, value) == 3 &&
                strcmp(row_platform, platform) == 0 && strcmp(row_name, name) == 0;
    }
    if (file) {
        fclose(file);
    }
    return found;
}

/* Compares with the row of this platform. Nothing fails when the platform has no row; pin_finish
 * says so. */
static void pin_exact(const char *name, unsigned depends_on, uint64_t hash) {
    char platform[PLATFORM_SIZE], value[64], pinned[64];
    platform_name(depends_on, platform);
    snprintf(value, sizeof value, "%016llx", (unsigned long long)hash);
    if (row_written(platform, name, value)) {
        return;
    }
    if (!row_find(platform, name, pinned)) {
        missing++;
    } else if (strcmp(value, pinned) != 0) {
        wrong++;
        printf("%s: %s, pinned is %s; " PIN_RENEW "\n", name, value, pinned);
    } else {
        compared++;
    }
}

/* Compares with the row that holds everywhere: |value - pinned| <= tolerance |pinned|. */
static void pin_near(const char *name, double value, double tolerance) {
    char text[64], pinned[64];
    snprintf(text, sizeof text, "%.12g", value);
    const int found = row_find("any", name, pinned);
    const double wanted = found ? atof(pinned) : NAN;
    const double share = fabs(value - wanted) / (tolerance * fabs(wanted));
    const int holds = share <= 1; /* not when it is NaN */
    if (row_written("any", name, holds ? pinned : text)) {
        return; /* what holds stays, or every compiler would write its own last digit */
    }
    if (!found) {
        printf("%s: %s is pinned nowhere; " PIN_RENEW "\n", name, text);
    } else if (!holds) {
        printf("%s: %s, pinned is %s within %g of it; " PIN_RENEW "\n", name, text, pinned,
               tolerance);
    } else if (share >= worst) {
        worst = share;
        snprintf(worst_name, sizeof worst_name, "%s", name);
    }
    compared += holds;
    wrong += !holds;
}

/* The platform's names and how many numbers are pinned here, on standard output; the number of
 * pins that differ. With PIN_ROWS=FILE in the environment nothing is compared: all rows are written
 * to FILE, for scripts/pin.sh. */
static int pin_finish(void) {
    char platform[PLATFORM_SIZE];
    platform_name(PIN_ON_MUJOCO | PIN_ON_ONEDNN, platform);
    printf("%s: %d pins hold, %d differ; plain numbers differ by at most %.2g of their tolerance "
           "(%s)\n",
           platform, compared, wrong, worst, worst_name);
    if (missing) {
        printf("nothing is pinned on this platform for %d hashes, so they are not compared; "
               "scripts/pin.sh \"reason\" pins them\n",
               missing);
    }
    if (rows && fclose(rows) != 0) {
        fprintf(stderr, "rows cannot be written\n");
        wrong++;
    }
    return wrong;
}

/* ---- press ---- */

static uint64_t hash_press(const PressResult *result) {
    uint64_t hash = PIN_HASH_START;
    for (int i = 0; i < result->count; i++) {
        const PressRow *row = &result->rows[i];
        const double numbers[] = {row->time,     row->depth,   row->force,   row->moment_x,
                                  row->moment_y, row->force_x, row->force_y, row->x,
                                  row->tilt,     row->contacts};
        hash = pin_hash(hash, numbers, sizeof numbers);
    }
    return hash;
}

static void pin_press(const char *kind, const char *ground, const PressDef *def) {
    MildError error = {0};
    MildSole *plate = press_plate_create(0.2, 0.1, &error);
    PressResult result = {0};
    char name[96];
    assert_non_null(plate);
    assert_int_equal(press_run(def, plate, &result, &error), MILD_OK);
    snprintf(name, sizeof name, "press.%s.%s", ground, kind);
    pin_exact(name, 0, hash_press(&result));
    snprintf(name, sizeof name, "press.%s.%s.peak_force", ground, kind);
    pin_near(name, result.peak_force, 1e-6);
    snprintf(name, sizeof name, "press.%s.%s.work_in", ground, kind);
    pin_near(name, result.work_in, 1e-6);
    press_result_close(&result);
    mild_sole_destroy(plate);
}

/* Down twice with the front edge lower, dragged, out; and dropped. */
TEST(presses) {
    for (int p = 0; p < PAPER_PRESETS; p++) {
        const char *ground = mild_material_preset_name(p);
        PressDef def = {.turns = 3, .turn = {0.01, 0.004, 0.02}, .speed = 0.05, .tilt = 0.05};
        mild_material_preset(ground, &def.material);
        pin_press("cycle", ground, &def);
        def.turns = 1;
        def.drag = 0.03;
        def.drag_speed = 0.1;
        pin_press("drag", ground, &def);
        def = (PressDef){.mass = 5, .height = 0.05, .seconds = 0.3, .material = def.material};
        pin_press("drop", ground, &def);
    }
}

/* ---- rollouts ---- */

enum { ENVS = 6, STEPS = 150 };

/* What the learner sees of every step: histories, critic inputs, rewards, ends of episodes. */
static uint64_t hash_rollout(const TaskDef *def) {
    static float history[ENVS * SA01_HISTORY], critic[ENVS * SA01_CRITIC], reward[ENVS];
    static float action[ENVS * SA01_JOINTS];
    static uint8_t flags[3 * ENVS];
    MildError error = {0};
    Pool *pool = pool_create(1);
    Envs *envs = kit_mujoco(def, robot, pool, ENVS, 7, &error);
    const EnvsView view = {history, critic, NULL, NULL};
    const EnvsStep step = kit_step(action, reward, flags, ENVS, view);
    uint64_t hash = PIN_HASH_START;
    assert_non_null(envs);
    envs_reset(envs, &view, NULL, &error);
    for (int t = 0; t < STEPS; t++) {
        for (int i = 0; i < ENVS * SA01_JOINTS; i++) {
            Random random = random_at(99, (uint32_t)i, (uint32_t)t);
            action[i] = (float)(6 * random_normal(&random));
        }
        envs_step(envs, &step, NULL, &error);
        hash = pin_hash(hash, history, sizeof history);
        hash = pin_hash(hash, critic, sizeof critic);
        hash = pin_hash(hash, reward, sizeof reward);
        hash = pin_hash(hash, flags, ENVS); /* done */
    }
    const EnvsStats stats = kit_stats(envs, ENVS);
    printf("%d falls in %d robots x %d steps\n", stats.falls, ENVS, STEPS);
    assert_true(stats.falls > 0 && stats.diverged == 0); /* new episodes are part of it */
    envs_destroy(envs);
    pool_destroy(pool);
    return hash;
}

/* The nominal robot stepping in place by hand-made joint angles: 0.4 s are too short for rounding
 * to grow into another motion. */
static void pin_short_walk(const char *ground, const TaskDef *like) {
    TaskDef def = kit_quiet_def();
    def.randomize.model = like->randomize.model;
    def.map = like->map;
    def.imprint_tiles = like->imprint_tiles;
    Rig rig;
    double reward = 0, load = 0;
    char name[96];
    rig_open(&rig, &def, 3, 0);
    rig.env->command_frozen = 1;
    rig.env->command[0] = 0.5;
    task_env_reset(rig.env, &rig.def, robot, rig.sim, &rig.view);
    for (int t = 0; t < 40; t++) {
        float action[SA01_JOINTS];
        for (int i = 0; i < SA01_JOINTS; i++) {
            action[i] = (float)(0.4 * sin(0.15 * t + 0.7 * i));
        }
        TaskStep step = rig_step(&rig, action);
        assert_true(step.valid);
        reward += (double)step.reward / 40;
        for (int f = 0; f < SA01_FEET; f++) {
            load += robot_sim_foot(rig.sim, f)->force[2] / 40;
        }
    }
    snprintf(name, sizeof name, "walk.%s.reward", ground);
    pin_near(name, reward, 1e-5);
    snprintf(name, sizeof name, "walk.%s.load", ground);
    pin_near(name, load, 1e-5);
    snprintf(name, sizeof name, "walk.%s.height", ground);
    pin_near(name, robot_sim_qpos(rig.sim)[2], 1e-5);
    rig_close(&rig);
}

TEST(rollouts_on_every_model) {
    for (int model = 0; model < MILD_MODELS; model++) {
        TaskDef def = task_def_default();
        char name[96];
        def.randomize.model = model;
        robot_set_model(robot, (MildModel)model);
        snprintf(name, sizeof name, "rollout.%s", mild_model_names[model]);
        pin_exact(name, PIN_ON_MUJOCO, hash_rollout(&def));
        pin_short_walk(mild_model_names[model], &def);
    }
    robot_set_model(robot, MILD_MODEL_MILD);
}

/* Uneven, of several materials, with prints that stay. */
TEST(rollout_on_a_map) {
    MildError error = {0};
    MildMapDef map_def = mild_map_def_default();
    map_def.kind = MILD_MAP_ROUGH;
    map_def.amplitude = 0.03;
    map_def.patches = MILD_PATTERN_CHECKER;
    map_def.border = 0.1;
    MildMap *map = mild_map_create(&map_def, &error);
    assert_non_null(map);
    TaskDef def = task_def_default();
    def.map = map;
    def.imprint_tiles = 64;
    pin_exact("rollout.map", PIN_ON_MUJOCO, hash_rollout(&def));
    pin_short_walk("map", &def);
    mild_map_destroy(map);
}

/* ---- trainings: hash of all parameters after two iterations ---- */

static void pin_policy(const char *what, unsigned depends_on, Policy *policy, double tolerance) {
    const float *parameters = policy_parameters(policy);
    const size_t count = (size_t)policy_parameter_count(policy);
    char name[96];
    double squares = 0;
    for (size_t i = 0; i < count; i++) {
        squares += (double)parameters[i] * (double)parameters[i];
    }
    snprintf(name, sizeof name, "training.%s", what);
    pin_exact(name, depends_on, pin_hash(PIN_HASH_START, parameters, count * sizeof *parameters));
    snprintf(name, sizeof name, "training.%s.norm", what);
    pin_near(name, sqrt(squares), tolerance);
}

TEST(training_of_the_toy) {
    MildError error = {0};
    Toy toy;
    PolicyDef policy_def = toy_policy_def();
    PpoDef def = ppo_def_default();
    PpoMirror mirror = toy_mirror();
    PpoReport report = {0};
    def.steps = 40;
    def.minibatches = 2;
    Policy *policy = policy_create(&policy_def, 5, &error);
    Pool *pool = pool_create(1);
    Ppo *ppo = ppo_create(&def, policy, pool, &mirror, 16, 11, &error);
    assert_non_null(ppo);
    toy_start(&toy, ppo);
    for (int i = 0; i < 2; i++) {
        toy_rollout(&toy, ppo);
        ppo_update(ppo, &report);
    }
    pin_policy("toy", PIN_ON_ONEDNN, policy, 1e-6);
    pin_near("training.toy.reward", toy.reward, 1e-5);
    pin_near("training.toy.value_loss", report.value_loss, 1e-5);
    pin_near("training.toy.reconstruction", report.vae_reconstruction, 1e-5);
    ppo_destroy(ppo);
    policy_destroy(policy);
    pool_destroy(pool);
}

TEST(training_of_the_robot) {
    MildError error = {0};
    ExperimentDef def = experiment_def_default();
    def.train.envs = 4;
    def.train.threads = 1;
    Trainer *trainer = train_create(&def, &error);
    TrainReport report = {0};
    assert_non_null(trainer);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(train_iterate(trainer, &report, &error), MILD_OK);
    }
    pin_policy("robot", PIN_ON_MUJOCO | PIN_ON_ONEDNN, train_policy(trainer), 1e-6);
    train_destroy(trainer);
}

TEST(all_pins_hold) {
    assert_int_equal(pin_finish(), 0);
}

TEST_MAIN(kit_setup, kit_teardown)
