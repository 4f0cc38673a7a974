/* Episodes of the Go1 that begin lying: how high its geoms are, how attitudes and joints are
 * spread, which episodes begin so, that the motors then only damp, and what ends an episode of a
 * robot that may lie. */
#include <mujoco/mujoco.h>

#include "env/task/task.h"
#include "materials.h"

#define GO1 MILD_SOURCE_DIR "/robots/go1"

enum { JOINTS = 12, FEET = 4, DRAWS = 400 };

static Robot *robot;
static TaskDef def;
static TaskEnv *env;
static RobotSim *sim;
static const EnvsView view;
static const MildTerrain *ground;

static int setup(void **unused) {
    (void)unused;
    MildError error = {0};
    robot = robot_create(GO1, &error);
    expect_good(robot != NULL, &error);
    robot_set_shells(robot, 1);
    return 0;
}

static int teardown(void **unused) {
    (void)unused;
    robot_destroy(robot);
    return 0;
}

static void open_env(TaskStart start) {
    MildError error = {0};
    def = task_def_default();
    task_def_make_nominal(&def);
    def.start = (int)start;
    def.may_lie = 1;
    def.randomize.latency[0] = def.randomize.latency[1] = 0;
    def.randomize.initial_velocity = 0;
    sim = robot_sim_create(robot, def.physics_dt, &error);
    env = aligned_alloc(64, task_env_bytes(&def, robot));
    assert_non_null(sim);
    assert_non_null(env);
    task_env_init(env, &def, robot, 3, 0);
}

static void close_env(void) {
    robot_sim_destroy(sim);
    free(env);
}

/* Draw `draw` of an episode on foam, or on a slope of it. */
static void begin(uint32_t draw, int rigid) {
    MildTerrain terrain = kit_terrain("foam45");
    terrain.height = 0.2;
    env->tick = draw;
    task_env_reset_on(env, &def, robot, sim, &terrain, rigid, &view);
    ground = task_env_terrain(env);
}

/* ---- heights ---- */

/* [m] Of its lowest sole or shell, each above the ground under it. */
static double gap_above(const MildMap *map) {
    MildTerrain terrain = *ground;
    terrain.map = map;
    task_env_load(env, sim);
    return fmin(robot_sim_sole_clearance(sim, &terrain), robot_sim_body_clearance(sim, &terrain));
}

/* Within 0.1 m of the ground and not below it, on level ground and on a slope; its quaternion has
 * length 1. */
TEST(nothing_begins_below_the_ground) {
    MildMapDef slope = mild_map_def_default();
    slope.kind = MILD_MAP_SLOPE;
    slope.slope = 0.2;
    MildMap *map = mild_map_create(&slope, NULL);
    assert_non_null(map);
    for (int n = TASK_START_BACK; n < 2 * TASK_STARTS; n++) {
        const int start = n % TASK_STARTS;
        double least = 1e9, most = -1e9;
        if (start < TASK_START_BACK) {
            continue;
        }
        open_env((TaskStart)start);
        def.map = n < TASK_STARTS ? NULL : map;
        for (uint32_t k = 0; k < DRAWS; k++) {
            begin(k, 0);
            const double gap = gap_above(def.map);
            assert_true(env->dropped);
            expect_near("length", mju_norm(env->robot.qpos + 3, 4), 1, 1e-12);
            least = fmin(least, gap);
            most = fmax(most, gap);
        }
        print_message("%s%s: lowest point %.2f to %.2f mm above the ground\n",
                      task_start_names[start], def.map ? ", slope" : "", 1e3 * least, 1e3 * most);
        assert_true(least > -1e-9 && least < 0.002 && most > 0.098 && most < 0.1);
        close_env();
    }
    mild_map_destroy(map);
}

/* ---- attitudes and joints ---- */

/* [-] Upward component of the base's z and y axes. */
static double up_of(int axis) {
    double R[9];
    mju_quat2Mat(R, env->robot.qpos + 3);
    return R[6 + axis];
}

/* Leans of at most 0.3 rad in roll and pitch: the cosine of both is cos(0.3)^2 = 0.91267. */
TEST(back_and_side) {
    int left = 0;
    open_env(TASK_START_BACK);
    for (uint32_t k = 0; k < DRAWS; k++) {
        begin(k, 0);
        assert_true(up_of(2) < -0.9126);
    }
    def.start = TASK_START_SIDE;
    for (uint32_t k = 0; k < DRAWS; k++) {
        begin(k, 0);
        assert_true(fabs(up_of(1)) > 0.9126);
        left += up_of(1) < 0;
    }
    assert_true(left > DRAWS * 0.4 && left < DRAWS * 0.6);
    close_env();
}

/* Each axis of the base is as likely to point anywhere: the vertical component of an axis is
 * uniform in [-1, 1], mean 0 and mean square 1/3; 4 standard deviations of 400 draws are 0.115 and
 * 0.06. */
TEST(any_attitude_is_as_likely) {
    double sum[3] = {0}, square[3] = {0};
    open_env(TASK_START_ANY);
    for (uint32_t k = 0; k < DRAWS; k++) {
        begin(k, 0);
        for (int i = 0; i < 3; i++) {
            sum[i] += up_of(i) / DRAWS;
            square[i] += up_of(i) * up_of(i) / DRAWS;
        }
    }
    for (int i = 0; i < 3; i++) {
        assert_true(fabs(sum[i]) < 0.115 && fabs(square[i] - 1.0 / 3) < 0.06);
    }
    close_env();
}

/* Joints are within their ranges and reach both ends. */
TEST(joints_are_anywhere) {
    const double *low = robot_joint_low(robot), *high = robot_joint_high(robot);
    double least[JOINTS], most[JOINTS];
    open_env(TASK_START_BACK);
    for (int i = 0; i < JOINTS; i++) {
        least[i] = 1e9;
        most[i] = -1e9;
    }
    for (uint32_t k = 0; k < DRAWS; k++) {
        begin(k, 0);
        for (int i = 0; i < JOINTS; i++) {
            const double share = (env->robot.qpos[7 + i] - low[i]) / (high[i] - low[i]);
            least[i] = fmin(least[i], share);
            most[i] = fmax(most[i], share);
        }
    }
    for (int i = 0; i < JOINTS; i++) {
        assert_true(least[i] >= 0 && least[i] < 0.03 && most[i] <= 1 && most[i] > 0.97);
    }
    close_env();
}

/* ---- which episodes ---- */

/* As many as asked for, on rigid ground too; the others stand as if nobody had asked. */
TEST(the_share_is_kept) {
    open_env(TASK_START_ANY);
    def.start_share = 0.3;
    for (int rigid = 0; rigid < 2; rigid++) {
        int dropped = 0;
        for (uint32_t k = 0; k < DRAWS; k++) {
            def.start = TASK_START_STAND;
            begin(k, rigid);
            assert_false(env->dropped);
            const TaskPose stands = env->robot;
            def.start = TASK_START_ANY;
            begin(k, rigid);
            dropped += env->dropped;
            assert_true(env->dropped || memcmp(&stands, &env->robot, sizeof stands) == 0);
        }
        /* 4 deviations */
        assert_true(dropped > DRAWS * 0.3 - 37 && dropped < DRAWS * 0.3 + 37);
    }
    close_env();
}

/* And none is dropped whose shells do not stand in this episode. */
TEST(only_shells_that_stand_are_dropped_on) {
    open_env(TASK_START_ANY);
    def.randomize.shells_share = 0.5;
    int stand = 0;
    for (uint32_t k = 0; k < DRAWS; k++) {
        begin(k, 0);
        assert_int_equal(env->dropped, env->variation.shells_stand);
        stand += env->variation.shells_stand;
    }
    assert_true(stand > DRAWS / 4 && stand < DRAWS * 3 / 4);
    close_env();
}

/* ---- limp, then not ---- */

static TaskStep step(const float *action) {
    return task_env_step(env, &def, robot, sim, action, 0, &view, NULL);
}

/* Speeds of the joints before a physics step, and the greatest distance of a torque from that of
 * damping alone, within the limit of the motor. */
typedef struct {
    double speed[JOINTS], apart;
} Damping;

static void compare_damping(void *context, const TaskEnv *at, const RobotSim *with,
                            const double *torque) {
    Damping *damping = context;
    const TaskGains *gains = &task_env_rest(env)->gains;
    (void)at;
    for (int i = 0; i < JOINTS; i++) {
        const double limit = gains->limit[i], asked = -gains->kd[i] * damping->speed[i];
        const double wanted = fmin(fmax(asked, -limit), limit);
        damping->apart = fmax(damping->apart, fabs(torque[i] - wanted));
        damping->speed[i] = robot_sim_qvel(with)[6 + i];
    }
}

/* For `settle` the torques are those of damping, whatever the action; then no longer. */
TEST(motors_only_damp_at_first) {
    float action[JOINTS];
    for (int i = 0; i < JOINTS; i++) {
        action[i] = i % 2 ? 1 : -1;
    }
    open_env(TASK_START_BACK);
    def.settle = 0.5;
    begin(7, 0);
    Damping damping = {.apart = 0};
    const TaskCallback callback = {compare_damping, &damping, NULL};
    for (int k = 0; k < 51; k++) {
        damping.apart = 0;
        task_env_step(env, &def, robot, sim, action, 0, &view, &callback);
        assert_true(k < 50 ? damping.apart < 1e-12 : damping.apart > 5);
    }
    def.start = TASK_START_STAND;
    begin(7, 0);
    memset(&damping, 0, sizeof damping);
    task_env_step(env, &def, robot, sim, action, 0, &view, &callback);
    assert_true(damping.apart > 1);
    close_env();
}

/* ---- what ends it ---- */

/* Dropped on its back it lies there, on soft or rigid ground. */
static void lie(uint32_t draw, int rigid) {
    const float none[JOINTS] = {0};
    begin(draw, rigid);
    for (int k = 0; k < 300; k++) {
        const TaskStep out = step(none);
        assert_true(!out.done && out.valid && out.cause == TASK_END_time);
    }
    assert_true(up_of(2) < -0.9);
}

/* Until its time is over; without may_lie its tilt, or its base on the ground, ends the episode at
 * once. */
TEST(a_robot_that_may_lie_is_not_ended) {
    const float none[JOINTS] = {0};
    open_env(TASK_START_BACK);
    lie(2, 1);
    lie(1, 0);
    env->variation.shells_stand = 0; /* not in this episode */
    assert_int_equal(step(none).cause, TASK_END_tilt);
    env->variation.shells_stand = 1;
    env->step = env->step_limit;
    assert_true(step(none).timeout);
    def.may_lie = 0;
    assert_int_equal(step(none).cause, TASK_END_tilt);
    def.tilt_limit = 3.1;
    mju_euler2Quat(env->robot.qpos + 3, (const double[3]){2.8, 0, 0}, "xyz");
    assert_int_equal(step(none).cause, TASK_END_base);
    def.may_lie = 1;
    assert_int_equal(step(none).cause, TASK_END_time);
    env->robot.qpos[7] = 0.863 + 0.8; /* a hip out of its range */
    assert_int_equal(step(none).cause, TASK_END_joint);
    env->robot.qpos[7] = 0;
    env->robot.qvel[0] = NAN;
    assert_int_equal(step(none).cause, TASK_END_not_finite);
    close_env();
}

TEST_MAIN(setup, teardown)
