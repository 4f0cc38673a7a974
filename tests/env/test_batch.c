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

/* What it sees of the ground, late and with noise. */
static TaskDef scan_def(void) {
    TaskDef def = some_def();
    def.scan = 5;
    return def;
}

TEST(follows_mujoco_with_a_scan) {
    MildMapDef map = some_map();
    follow(SA01, scan_def(), MILD_BATCH_HOST, &map, 0.85);
    follow(SA01, scan_def(), MILD_BATCH_HOST, NULL, 0.85);
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

/* Arms that something else moves. Their targets are those of the CPU to the last bit. */
static TaskDef driven_def(void) {
    TaskDef def = some_def();
    def.driven_share = 0.7;
    def.action_scale = 0.1;
    def.randomize.base_mass[0] = -1;
    return def;
}

TEST(driven_joints_follow_mujoco) {
    TaskDef def = driven_def();
    int moved = 0;
    follow(G1_29, def, MILD_BATCH_HOST, NULL, 0.85);
    def.episode = 24;
    pair_open(G1_29, &def, MILD_BATCH_HOST);
    pair_reset();
    memset(pair.a.action, 0, sizeof pair.a.action);
    for (int t = 0; t < 180; t++) { /* the second goals of most */
        pair_step();
    }
    for (int e = 0; e < ENVS; e++) {
        size_t bytes;
        const char *envs = envs_state(pair.mujoco, &bytes);
        const TaskEnv *a = (const TaskEnv *)(const void *)(envs + (size_t)e * (bytes / ENVS));
        const Episode b = episode_of(pair.batch, e);
        for (int i = pair.shape.actions; a->step == b.step && i < pair.shape.joints; i++) {
            assert_true(a->action[0][i] == b.action[i]);
            moved += a->action[0][i] != a->action[2][i];
        }
    }
    assert_true(moved > 100);
    pair_close();
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
    follow(SA01, scan_def(), 0, &map, 0.85);
    follow(GO1, some_def(), 0, NULL, 0.85);
    follow(GO1, some_def(), 0, &map, 0.85);
    follow(G1_29, driven_def(), 0, NULL, 0.85);
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

TEST_MAIN(NULL, NULL)
