/* Robots on one map: results independent of thread count, state without pointers that continues bit
 * for bit, heights of start, feet and base above the ground under them. */
#include "base/random.h"
#include "env/task/task.h"
#include "envs_kit.h"
#include "kit.h"
#include "sa01.h"

enum { ENVS = 6, STEPS = 60, TILES = 64 };

static Robot *robot;
static MildMap *map;

static int setup(void **state) {
    (void)state;
    MildError error = {0};
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_ROUGH;
    def.amplitude = 0.03;
    def.patches = MILD_PATTERN_CHECKER;
    def.border = 0.1;
    map = mild_map_create(&def, &error);
    robot = map ? robot_create(SA01, &error) : NULL;
    if (!robot) {
        fprintf(stderr, "%s\n", error.text);
    }
    return robot == NULL;
}

static int teardown(void **state) {
    (void)state;
    robot_destroy(robot);
    mild_map_destroy(map);
    return 0;
}

static TaskDef task_on_map(void) {
    TaskDef def = task_def_default();
    def.map = map;
    def.imprint_tiles = TILES;
    return def;
}

typedef struct {
    Pool *pool;
    Envs *envs;
    float *action, *reward;
    uint8_t *flags;
    int step;
} Run;

static void run_open(Run *run, int threads) {
    TaskDef def = task_on_map();
    MildError error = {0};
    *run = (Run){.pool = pool_create(threads)};
    run->envs = kit_mujoco(&def, robot, run->pool, ENVS, 7, &error);
    assert_non_null(run->envs);
    run->action = calloc(ENVS * SA01_JOINTS, sizeof *run->action);
    run->reward = calloc(ENVS, sizeof *run->reward);
    run->flags = calloc(ENVS, 3);
    const EnvsView none = {0};
    envs_reset(run->envs, &none, NULL, &error);
}

static void run_steps(Run *run, int steps) {
    const EnvsView none = {0};
    const EnvsStep step = kit_step(run->action, run->reward, run->flags, ENVS, none);
    for (int t = 0; t < steps; t++, run->step++) {
        for (int i = 0; i < ENVS * SA01_JOINTS; i++) {
            Random r = random_at(5, (uint32_t)i, (uint32_t)run->step);
            run->action[i] = (float)(0.5 * random_normal(&r));
        }
        envs_step(run->envs, &step, NULL, NULL);
    }
}

static void run_close(Run *run) {
    envs_destroy(run->envs);
    pool_destroy(run->pool);
    free(run->action);
    free(run->reward);
    free(run->flags);
}

TEST(test_threads) {
    uint64_t hash[3];
    for (int i = 0; i < 3; i++) {
        Run run;
        run_open(&run, i == 0 ? 1 : 3);
        run_steps(&run, STEPS);
        hash[i] = kit_hash(run.envs, ENVS);
        run_close(&run);
    }
    printf("map and prints, 1, 3 and 3 threads: %016llx\n", (unsigned long long)hash[0]);
    assert_true(hash[0] == hash[1] && hash[1] == hash[2]);
}

/* Saved half way, loaded into robots of another history: the rest is the same. No address is among
 * the bytes. */
TEST(test_save) {
    Run a, b;
    size_t bytes;
    run_open(&a, 2);
    run_steps(&a, STEPS / 2);
    void *block = envs_state(a.envs, &bytes);
    char *saved = malloc(bytes);
    memcpy(saved, block, bytes);
    for (size_t at = 0; at + sizeof map <= bytes; at += sizeof(int32_t)) {
        assert_memory_not_equal(saved + at, &map, sizeof map);
    }
    run_steps(&a, STEPS / 2);
    run_open(&b, 2);
    run_steps(&b, STEPS / 2);
    run_steps(&b, 7);
    b.step = STEPS / 2;
    memcpy(envs_state(b.envs, &bytes), saved, bytes);
    run_steps(&b, STEPS / 2);
    assert_true(kit_hash(a.envs, ENVS) == kit_hash(b.envs, ENVS));
    printf("%zu bytes a robot, %d tiles of prints among them\n", bytes / ENVS, TILES);
    free(saved);
    run_close(&a);
    run_close(&b);
}

/* Wherever a robot starts, its lowest sole point begins as deep as on level ground; nobody stands
 * in the air or falls through. */
TEST(test_start) {
    TaskDef def = task_on_map();
    def.randomize.rigid_share = 0;
    MildError error = {0};
    RobotSim *sim = robot_sim_create(robot, def.physics_dt, &error);
    TaskEnv *env = aligned_alloc(64, task_env_bytes(&def, robot));
    EnvsView none = {0};
    double deepest = 0, shallowest = 1, apart = 0;
    for (int i = 0; i < 40; i++) {
        task_env_init(env, &def, robot, 3, (uint32_t)i);
        task_env_reset(env, &def, robot, sim, &none);
        assert_null(task_env_rest(env)->terrain.map);
        MildTerrain terrain = task_env_rest(env)->terrain;
        terrain.map = map;
        double clearance = robot_sim_sole_clearance(sim, &terrain),
               base = mild_terrain_height_at(&terrain, 0, 0);
        deepest = fmin(deepest, clearance);
        shallowest = fmin(shallowest, -clearance);
        apart = fmax(apart, fabs(robot_sim_qpos(sim)[2] - base - robot_stand_height(robot)));
        assert_true(terrain.material_count >= 2);
    }
    printf("starts: lowest sole point %.1f to %.1f mm deep, base at most %.0f mm from its height "
           "on level ground\n",
           1e3 * shallowest, -1e3 * deepest, 1e3 * apart);
    assert_true(deepest > -0.06 && shallowest > -0.003 && apart < 0.12);
    free(env);
    robot_sim_destroy(sim);
}

/* On rigid ground too: 2 mm above the map's highest point under a sole, and half a second later the
 * feet are on it. */
TEST(test_rigid) {
    TaskDef def = task_on_map();
    def.randomize.rigid_share = 1;
    MildError error = {0};
    RobotSim *sim = robot_sim_create(robot, def.physics_dt, &error);
    TaskEnv *env = aligned_alloc(64, task_env_bytes(&def, robot));
    EnvsView none = {0};
    double off = 0, deepest = 0, highest = -1;
    for (int i = 0; i < 20; i++) {
        task_env_init(env, &def, robot, 4, (uint32_t)i);
        task_env_reset(env, &def, robot, sim, &none);
        MildTerrain terrain = task_env_rest(env)->terrain;
        terrain.map = map;
        off = fmax(off, fabs(robot_sim_sole_clearance(sim, &terrain) - 0.002));
        for (int s = 0; s < 200; s++) {
            double torque[SA01_JOINTS] = {0};
            assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, task_env_ground(env)), 0);
        }
        double clearance = robot_sim_sole_clearance(sim, &terrain);
        deepest = fmin(deepest, clearance);
        highest = fmax(highest, clearance);
    }
    printf("rigid starts: off by %.1e m; limp for half a second, lowest sole points %.1f to %.1f "
           "mm above the map\n",
           off, 1e3 * deepest, 1e3 * highest);
    assert_true(off < 1e-9);
    assert_true(deepest > -0.02 && highest < 0.002);
    free(env);
    robot_sim_destroy(sim);
}

TEST_MAIN(setup, teardown)
