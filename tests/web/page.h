/* The robots of the page, its core on one of them, and what it is compared with. */
#ifndef TESTS_WEB_PAGE_H
#define TESTS_WEB_PAGE_H

#include "kit.h"

#define MILD_REAL_FLOAT
#include "env/envs.h"
#include "env/task/ground.h"
#include "learn/policy.h"
#include "mild/batch.h"
#include "run/config/experiment_keys.h"
#include "sa01.h"
#include "web/core.h"

enum { SECOND = 100 /* policy steps */ };

/* The robots of the page. All have as many joints, and see as much but for the rise of a jump. */
enum { ON_SA01, ON_G1, ON_GO1, ROBOTS, ON_G1_RUN = ROBOTS, ON_G1_JUMP, PAGES };

typedef struct {
    const char *name, *robot_name, *policy, *config;
    WebModel *model;
    size_t bytes;
    Robot *robot;
    Policy *weights;
    TaskDef task;
} Page;

static Page pages[PAGES] = {
    {.name = "sa01", .robot_name = "sa01", .policy = "mild", .config = "walk"},
    {.name = "g1", .robot_name = "g1", .policy = "g1", .config = "g1"},
    {.name = "go1", .robot_name = "go1", .policy = "go1", .config = "go1"},
    {.name = "g1_run", .robot_name = "g1", .policy = "g1_run", .config = "g1_run"},
    {.name = "g1_jump", .robot_name = "g1", .policy = "g1_jump", .config = "g1_jump"}};
static Pool *pool;
/* Of the robot that the tests are on: SA01, where they do not choose another. */
static WebModel *model;
static size_t model_bytes;
static Robot *robot;
static Policy *policy;
static TaskDef task;

static inline void choose(int which) {
    const Page *page = &pages[which];
    model = page->model;
    model_bytes = page->bytes;
    robot = page->robot;
    policy = page->weights;
    task = page->task;
}

static inline void open_page(Page *page) {
    char path[512], config[512], unused[TRAIN_ROBOT_SIZE];
    MildError error = {0};
    snprintf(path, sizeof path, "%s/%s.bin", WEB_ROBOTS, page->name);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    page->model = aligned_alloc(64, 1 << 20);
    page->bytes = fread(page->model, 1, 1 << 20, file);
    fclose(file);
    snprintf(path, sizeof path, MILD_SOURCE_DIR "/robots/%s", page->robot_name);
    page->robot = robot_create(path, &error);
    snprintf(path, sizeof path, MILD_SOURCE_DIR "/policies/%s.safetensors", page->policy);
    page->weights = policy_load(path, NULL, 0, &error);
    assert_non_null(page->robot);
    assert_non_null(page->weights);
    snprintf(config, sizeof config, MILD_SOURCE_DIR "/configs/%s.ini", page->config);
    assert_int_equal(experiment_task(&page->task, 0, unused, config, path, &error), MILD_OK);
    robot_set_shells(page->robot, page->task.shells_stand);
    const int jumps = page->task.jump[1] > 0;
    assert_int_equal(page->model->shape.history, SA01_HISTORY + TASK_FRAMES * jumps);
    assert_int_equal(page->model->shape.actions, SA01_JOINTS);
}

static inline int setup(void **state) {
    (void)state;
    pool = pool_create(1);
    for (int i = 0; i < PAGES; i++) {
        open_page(&pages[i]);
    }
    choose(ON_SA01);
    return 0;
}

static inline int teardown(void **state) {
    (void)state;
    for (int i = 0; i < PAGES; i++) {
        policy_destroy(pages[i].weights);
        robot_destroy(pages[i].robot);
        free(pages[i].model);
    }
    pool_destroy(pool);
    return 0;
}

static inline int preset(const char *name) {
    for (int i = 0; i < mild_material_preset_count(); i++) {
        if (strcmp(name, mild_material_preset_name(i)) == 0) {
            return i;
        }
    }
    fail_msg("no ground %s", name);
    return -1;
}

static inline void start(int ground, int relief, int prints) {
    assert_null(web_open(model, model_bytes));
    assert_null(web_start(ground, relief, prints));
}

/* ---- beside the batch engine ---- */

typedef struct {
    EnvsTrial trial;
    MildTerrain terrain;
    Envs *envs;
    float history[SA01_HISTORY], reward;
    uint8_t done, timeout, valid, cause;
} Rival;

/* batch: bool, the batch engine; else MuJoCo on mild_ground_solve. material: NULL: rigid ground.
 * speed: [m/s] forward. */
static inline void rival_start_material(Rival *rival, int batch, const MildMaterial *material,
                                        double speed) {
    MildError error = {0};
    const MildMaterial unused = mild_material_default();
    rival->terrain = mild_terrain_uniform(material ? material : &unused);
    rival->trial = (EnvsTrial){.rigid = !material};
    const EnvsDef def = {.task = &task,
                         .robot = robot,
                         .pool = pool,
                         .batch = batch,
                         .device = MILD_BATCH_HOST,
                         .count = 1,
                         .seed = 1,
                         .trial = &rival->trial,
                         .terrain = &rival->terrain,
                         .terrains = 1};
    const double stand[TASK_COMMANDS] = {0}, walk[TASK_COMMANDS] = {speed};
    const EnvsView view = {.history = rival->history};
    rival->envs = envs_create(&def, &error);
    assert_non_null(rival->envs);
    assert_int_equal(envs_set_commands(rival->envs, stand, &error), MILD_OK);
    assert_int_equal(envs_reset(rival->envs, &view, NULL, &error), MILD_OK);
    assert_int_equal(envs_set_commands(rival->envs, walk, &error), MILD_OK);
}

/* The same on a ground of the page. stiffness: factor of the material's. */
static inline void rival_start_on(Rival *rival, int batch, int ground, double stiffness,
                                  double speed) {
    MildMaterial material;
    if (ground == WEB_RIGID) {
        rival_start_material(rival, batch, NULL, speed);
        return;
    }
    mild_material_preset(mild_material_preset_name(ground), &material);
    material.k_pen *= stiffness;
    material.sigma_cone *= stiffness;
    rival_start_material(rival, batch, &material, speed);
}

static inline void rival_start(Rival *rival, int ground, double stiffness, double speed) {
    rival_start_on(rival, 1, ground, stiffness, speed);
}

static inline void rival_step(Rival *rival, const float *action) {
    MildError error = {0};
    const EnvsStep step = {.action = action,
                           .reward = &rival->reward,
                           .done = &rival->done,
                           .timeout = &rival->timeout,
                           .valid = &rival->valid,
                           .cause = &rival->cause,
                           .next = {.history = rival->history}};
    assert_int_equal(envs_step(rival->envs, &step, NULL, &error), MILD_OK);
}

/* Largest difference of two histories. */
static inline double apart(const float *a, const float *b) {
    double worst = 0;
    for (int i = 0; i < SA01_HISTORY; i++) {
        worst = fmax(worst, fabs((double)a[i] - (double)b[i]));
    }
    return worst;
}

#endif
