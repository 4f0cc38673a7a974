/* The environments of a device against those of the CPU, which MuJoCo steps: the same episodes, the
 * same observations and rewards. By the same code on the CPU; with MILD_CUDA on the device too. */
#include "follow.h"

#include "device/device.h"
#include "mild/batch.h"

static int has_device(int device) {
    MildError error;
    return device_open(device, &error) == MILD_OK;
}

TEST(follows_mujoco) {
    follow(SA01, some_def(), MILD_BATCH_HOST, NULL, 0.85);
}

TEST(follows_mujoco_on_a_map) {
    const MildMapDef map = some_map();
    follow(SA01, some_def(), MILD_BATCH_HOST, &map, 0.85);
}

/* The keys of the paper's own training (configs/paper.ini), whose ground creates energy. */
static TaskDef printed_def(void) {
    TaskDef def = some_def();
    def.torque_hold = 1;
    def.standing_below = 0;
    def.vx[1] = def.vy[1] = def.wz[1] = 0.3; /* some would stand */
    def.vy[0] = def.wz[0] = 0;
    def.velocity_scale = def.height_scale = 1;
    def.reward.tracking_narrow = 0;
    def.reward.tracking_time = 0.01;
    def.reward.clearance_form = TASK_CLEARANCE_ERROR;
    def.reward.gait_form = TASK_GAIT_SUM;
    def.reward.acceleration_form = TASK_ACCELERATION_LINEAR;
    def.randomize.preset_share = 0;
    def.randomize.passive = 0;
    def.randomize.k_drift[1] = 900;
    return def;
}

TEST(follows_mujoco_as_printed) {
    follow(SA01, printed_def(), MILD_BATCH_HOST, NULL, 0.65);
}

static TaskDef model_def(MildModel model) {
    TaskDef def = some_def();
    def.randomize.model = (int)model;
    return def;
}

TEST(follows_mujoco_on_other_models) {
    const MildMapDef map = some_map();
    follow(SA01, model_def(MILD_MODEL_ECC_QUASI), MILD_BATCH_HOST, NULL, 0.85);
    follow(SA01, model_def(MILD_MODEL_ECC_QUASI_3D), MILD_BATCH_HOST, NULL, 0.6);
    follow(SA01, model_def(MILD_MODEL_BEKKER), MILD_BATCH_HOST, &map, 0.85);
    follow(SA01, model_def(MILD_MODEL_RIGID), MILD_BATCH_HOST, NULL, 0.85);
}

/* Soles of few elements, on a map for the rows of its kernels. */
static TaskDef coarse_def(void) {
    TaskDef def = some_def();
    def.sole_elements = 20;
    return def;
}

TEST(follows_mujoco_on_coarse_soles) {
    const MildMapDef map = some_map();
    follow(SA01, coarse_def(), MILD_BATCH_HOST, NULL, 0.85);
    follow(SA01, coarse_def(), MILD_BATCH_HOST, &map, 0.85);
}

/* Four round feet; on a map in test_go1.c. */
TEST(go1_follows_mujoco) {
    follow(GO1, some_def(), MILD_BATCH_HOST, NULL, 0.85);
}

/* A robot that is thrown diverges, and alone begins a new episode. */
TEST(one_diverges) {
    const TaskDef def = some_def();
    pair_open(SA01, &def, MILD_BATCH_HOST);
    pair_reset();
    episode_throw(pair.batch, 5, 1e4);
    pair_step();
    for (int e = 0; e < ENVS; e++) {
        assert_int_equal(pair.b.valid[e], e != 5);
        assert_true(e != 5 || (pair.b.done[e] && !pair.b.timeout[e] && pair.b.reward[e] == 0));
    }
    const Episode next = episode_of(pair.batch, 5);
    assert_true(next.step == 0 && next.qpos[0] == 0);
    pair_close();
}

TEST(device_follows_mujoco) {
    if (!has_device(0)) {
        skip();
    }
    const MildMapDef map = some_map();
    follow(SA01, some_def(), 0, NULL, 0.85);
    follow(SA01, some_def(), 0, &map, 0.85);
    follow(SA01, coarse_def(), 0, NULL, 0.85);
    follow(SA01, printed_def(), 0, NULL, 0.65);
    follow(GO1, some_def(), 0, NULL, 0.85);
    follow(GO1, some_def(), 0, &map, 0.85);
    follow(SA01, model_def(MILD_MODEL_ECC_QUASI), 0, NULL, 0.85);
    follow(SA01, model_def(MILD_MODEL_ECC_QUASI_3D), 0, &map, 0.6);
    follow(SA01, model_def(MILD_MODEL_BEKKER), 0, NULL, 0.85);
}

/* Whatever device is the caller's current one. */
TEST(second_device_follows_mujoco) {
    if (!has_device(1)) {
        skip();
    }
    follow(SA01, some_def(), 1, NULL, 0.85);
}

/* The sample of a physics step above the map. */
static void check_sample(const EnvsSample *sample, const MildTerrain *terrain) {
    const double *base = sample->base;
    const double above = base[2] - mild_terrain_height_at(terrain, base[0], base[1]);
    assert_true(sample->valid && fabs(sample->above - above) < 1e-5);
}

static void choose_trial(int i, EnvsTrial *trial, double command[TASK_COMMANDS]) {
    *trial = (EnvsTrial){.stream = (uint32_t)(i % 2), .ground = i / 2, .rigid = i == 3};
    command[0] = 0.1 * i;
    command[1] = -0.2;
    command[2] = 0.3;
    command[TASK_RISE] = 0;
}

static void check_trial(Envs *envs, int i, int t, const double command[TASK_COMMANDS]) {
    const Episode is = episode_of(envs, i);
    assert_true(is.index == (uint32_t)(i % 2) && is.ground[0] == i / 2);
    assert_true(is.map[0] == 0 && is.map[1] == 0);
    assert_true(is.rigid == (i == 3));
    assert_near(is.friction, 0.8, 1e-7);
    for (int k = 0; k < 3; k++) {
        assert_near(is.command[k], command[k], 1e-7);
    }
    assert_true(t > 0 || (is.step == 0 && is.qpos[6] == 0));
}

/* Trials have what was chosen for them in every episode, and no more: ground, the map's origin,
 * random numbers by their stream, a command that stays, a start along x. */
TEST(trials_are_chosen) {
    MildError error = {0};
    enum { TRIALS = 6 };
    MildMapDef waves = mild_map_def_default();
    waves.kind = MILD_MAP_WAVES;
    TaskDef def = some_def();
    MildMap *map = mild_map_create(&waves, &error);
    MildTerrain ground[3];
    EnvsTrial trial[TRIALS];
    double command[TRIALS][TASK_COMMANDS];
    static float history[TRIALS][SA01_HISTORY], action[TRIALS][SA01_JOINTS], reward[TRIALS];
    static EnvsSample sample[TRIALS][2];
    uint8_t flags[3][TRIALS];
    const EnvsView view = {.history = history[0]};
    const EnvsStep step = {.action = action[0],
                           .reward = reward,
                           .done = flags[0],
                           .timeout = flags[1],
                           .valid = flags[2],
                           .next = view};
    expect_good(map != NULL, &error);
    def.map = map;
    const MildMaterial any = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&any);
    assert_int_equal(mild_terrain_set_map(&terrain, map, &error), MILD_OK);
    Robot *robot = robot_create(SA01, &error);
    Pool *pool = pool_create(2);
    for (int i = 0; i < 3; i++) {
        MildMaterial material = any;
        material.k_pen = 300 + 100 * i;
        ground[i] = mild_terrain_uniform(&material);
    }
    for (int i = 0; i < TRIALS; i++) {
        choose_trial(i, &trial[i], command[i]);
    }
    const EnvsDef of = {.task = &def,
                        .robot = robot,
                        .pool = pool,
                        .batch = 1,
                        .device = MILD_BATCH_HOST,
                        .count = TRIALS,
                        .seed = 7,
                        .trial = trial,
                        .terrain = ground,
                        .terrains = 3};
    Envs *envs = envs_create(&of, &error);
    expect_good(envs != NULL, &error);
    assert_int_equal(envs_physics_steps(envs), 2);
    envs_set_samples(envs, sample[0]);
    assert_int_equal(envs_set_commands(envs, command[0], &error), MILD_OK);
    assert_int_equal(envs_reset(envs, &view, NULL, &error), MILD_OK);
    for (int t = 0; t <= 130; t++) { /* falls and time limits begin further episodes */
        for (int i = 0; i < TRIALS; i++) {
            check_trial(envs, i, t, command[i]);
        }
        const Episode first = episode_of(envs, 0);
        const Episode fourth = episode_of(envs, 4);
        assert_true(t > 0 || memcmp(first.kp_scale, fourth.kp_scale, sizeof first.kp_scale) == 0);
        assert_int_equal(envs_step(envs, &step, NULL, &error), MILD_OK);
        for (int i = 0; i < TRIALS; i++) {
            check_sample(&sample[i][0], &terrain);
            check_sample(&sample[i][1], &terrain);
        }
    }
    /* one that is thrown diverges in the first physics step of the next policy step */
    episode_throw(envs, 2, 1e4);
    assert_int_equal(envs_step(envs, &step, NULL, &error), MILD_OK);
    for (int i = 0; i < TRIALS; i++) {
        assert_true(flags[2][i] == (i != 2) && sample[i][0].valid == (i != 2));
    }
    envs_destroy(envs);
    pool_destroy(pool);
    robot_destroy(robot);
    mild_map_destroy(map);
}

TEST_MAIN(NULL, NULL)
