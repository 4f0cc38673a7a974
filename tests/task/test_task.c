/* The task as a whole: robots on one map, whose numbers do not depend on the thread count and go on
 * bit for bit when they are saved, heights at the start; mirrored motion. */
#include "task_kit.h"

#include "envs_kit.h"
#include "sa01.h"

enum { ENVS = 12, STEPS = 100, TILES = 64 };

static MildMap *map;

static int setup(void **state) {
    MildError error = {0};
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_ROUGH;
    def.amplitude = 0.03;
    def.patches = MILD_PATTERN_CHECKER;
    def.border = 0.1;
    map = mild_map_create(&def, &error);
    expect_good(map != NULL, &error);
    return kit_setup(state);
}

static int teardown(void **state) {
    mild_map_destroy(map);
    return kit_teardown(state);
}

static void random_actions(float *action, int envs, int t, double size) {
    for (int e = 0; e < envs; e++) {
        Random r = random_at(99, (uint32_t)e, (uint32_t)t);
        for (int i = 0; i < SA01_JOINTS; i++) {
            action[e * SA01_JOINTS + i] = (float)(size * random_normal(&r));
        }
    }
}

/* On the map, with prints; every robot begins a second episode. */
static TaskDef task_on_map(void) {
    TaskDef def = task_def_default();
    def.map = map;
    def.imprint_tiles = TILES;
    def.episode = 0.5;
    return def;
}

typedef struct {
    Pool *pool;
    Envs *envs;
    int step;
} Run;

static Run run_open(int threads) {
    TaskDef def = task_on_map();
    MildError error = {0};
    Run run = {.pool = pool_create(threads)};
    run.envs = kit_mujoco(&def, robot, run.pool, ENVS, 7, &error);
    assert_non_null(run.envs);
    const EnvsView none = {0};
    envs_reset(run.envs, &none, NULL, &error);
    return run;
}

static void run_steps(Run *run, int steps) {
    static float history[ENVS][SA01_HISTORY], critic[ENVS][SA01_CRITIC], action[ENVS][SA01_JOINTS];
    static float reward[ENVS];
    uint8_t flags[3 * ENVS];
    const EnvsView view = {.history = history[0], .critic = critic[0]};
    const EnvsStep step = kit_step(action[0], reward, flags, ENVS, view);
    for (int t = 0; t < steps; t++, run->step++) {
        random_actions(action[0], ENVS, run->step, 0.6);
        envs_step(run->envs, &step, NULL, NULL);
    }
    for (int e = 0; e < ENVS; e++) {
        for (int i = 0; i < SA01_HISTORY; i++) {
            assert_true(isfinite(history[e][i]));
        }
        for (int i = 0; i < SA01_CRITIC; i++) {
            assert_true(isfinite(critic[e][i]) && fabsf(critic[e][i]) < 100);
        }
    }
}

static void run_close(Run *run) {
    envs_destroy(run->envs);
    pool_destroy(run->pool);
}

/* What the numbers are is pinned by tests/pins. */
TEST(same_numbers_whatever_the_thread_count) {
    static const int threads[] = {1, 2, 3, 3};
    uint64_t hash[4];
    for (int i = 0; i < 4; i++) {
        Run run = run_open(threads[i]);
        run_steps(&run, STEPS);
        hash[i] = kit_hash(run.envs, ENVS);
        const EnvsStats stats = kit_stats(run.envs, ENVS);
        assert_true(stats.episodes >= ENVS && stats.diverged == 0);
        assert_true(hash[i] == hash[0]);
        run_close(&run);
    }
}

/* Saved half way, loaded into robots of another history: the rest is the same. No address is among
 * the bytes. */
TEST(saved_robots_go_on) {
    size_t bytes;
    Run a = run_open(2), b = run_open(2);
    run_steps(&a, STEPS / 2);
    void *block = envs_state(a.envs, &bytes);
    char *saved = malloc(bytes);
    memcpy(saved, block, bytes);
    for (size_t at = 0; at + sizeof map <= bytes; at += sizeof(int32_t)) {
        assert_memory_not_equal(saved + at, &map, sizeof map);
    }
    run_steps(&a, STEPS / 2);
    run_steps(&b, STEPS / 2 + 7);
    b.step = STEPS / 2;
    memcpy(envs_state(b.envs, &bytes), saved, bytes);
    run_steps(&b, STEPS / 2);
    assert_true(kit_hash(a.envs, ENVS) == kit_hash(b.envs, ENVS));
    free(saved);
    run_close(&a);
    run_close(&b);
}

/* Wherever a robot starts on soft ground, its lowest sole point begins as deep as on level ground;
 * on rigid ground 2 mm above the map's highest point under a sole. */
TEST(starts_on_a_map) {
    TaskDef def = task_on_map();
    double deepest = 0, shallowest = 1, apart = 0, off = 0;
    for (uint32_t i = 0; i < 60; i++) {
        const int rigid = i % 3 == 2;
        Rig rig;
        def.randomize.rigid_share = rigid;
        rig_open(&rig, &def, 3, i);
        task_env_reset(rig.env, &rig.def, robot, rig.sim, &rig.view);
        assert_null(task_env_rest(rig.env)->terrain.map);
        MildTerrain terrain = task_env_rest(rig.env)->terrain;
        terrain.map = map;
        const double clearance = robot_sim_sole_clearance(rig.sim, &terrain),
                     base = mild_terrain_height_at(&terrain, 0, 0);
        if (rigid) {
            off = fmax(off, fabs(clearance - 0.002));
        } else {
            deepest = fmax(deepest, -clearance);
            shallowest = fmin(shallowest, -clearance);
        }
        apart = fmax(apart, fabs(robot_sim_qpos(rig.sim)[2] - base - robot_stand_height(robot)));
        assert_true(terrain.material_count >= 2);
        rig_close(&rig);
    }
    printf("starts: lowest sole point %.1f to %.1f mm deep, base at most %.0f mm from its height "
           "on level ground; on rigid ground off by %.1e m\n",
           1e3 * shallowest, 1e3 * deepest, 1e3 * apart, off);
    assert_true(deepest < 0.06 && shallowest > -0.003 && apart < 0.12 && off < 1e-9);
}

/* Mirrored start and mirrored actions give the mirrored observation: mirror table and robot agree.
 * frame: [shape.observation] the last one. */
static void expect_mirrored(const TaskDef *def, float *frame) {
    const TaskMirror sides = task_mirror(def, robot);
    const int width = task_shape(def, robot).observation;
    Rig a, b;
    rig_open(&a, def, 3, 0);
    rig_open(&b, def, 3, 0);
    rig_start(&a, 0.5, 0, 0);
    rig_start(&b, 0.5, 0, 0);
    a.env->phase = 0.1;
    b.env->phase = 0.6;
    for (int t = 0; t < 12; t++) {
        float action[SA01_JOINTS], mirrored[SA01_JOINTS];
        random_actions(action, 1, t, 0.3);
        for (int i = 0; i < SA01_JOINTS; i++) {
            mirrored[i] = sides.action_sign[i] * action[sides.action_index[i]];
        }
        rig_step(&a, action);
        rig_step(&b, mirrored);
        for (int i = 0; i < width; i++) {
            float image = sides.observation_sign[i] * a.frame[sides.observation_index[i]];
            /* the vendor's left and right links differ by a few grams */
            expect_entry("mirror image", i, (double)b.frame[i], (double)image, 0.05);
        }
    }
    memcpy(frame, a.frame, (size_t)width * sizeof *frame);
    rig_close(&a);
    rig_close(&b);
}

TEST(mirrored_motion_is_the_mirror_image) {
    const TaskDef def = kit_quiet_def();
    float frame[TASK_OBSERVATION_MAX];
    expect_mirrored(&def, frame);
}

TEST_MAIN(setup, teardown)
