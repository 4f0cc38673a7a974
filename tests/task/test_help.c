/* What acts on the base from outside: pushes (schedule, size, fading) and the helping hand (wrench,
 * led pose, level). */
#include "sa01.h"
#include "task_oracle.h"

static void open_in_the_air(uint32_t index) {
    TaskDef def = kit_quiet_def();
    def.crossing_limit = -1;
    rig_open(&rig, &def, 3, index);
    rig_go_limp(&rig);
    rig_start(&rig, 0.5, 0, 0);
    kit_put(rig.env, kit_state(3));
}

static int open_first(void **state) {
    (void)state;
    open_in_the_air(0);
    return 0;
}

static int is_pushed(const double before[6]) {
    for (int i = 0; i < 6; i++) {
        if (fabs(rig.env->push[i] - 0.95 * before[i]) > 1e-12) {
            return 1;
        }
    }
    return 0;
}

/* Steps of the episode in which a push comes, up to `steps`. */
static int find_pushes(uint32_t index, uint32_t first, int steps, int found[8]) {
    open_in_the_air(index);
    rig.def.randomize.push_interval = 8;
    rig.env->step = first;
    int count = 0;
    for (int t = 0; t < steps; t++) {
        double before[6];
        uint32_t step = rig.env->step;
        memcpy(before, rig.env->push, sizeof before);
        kit_put(rig.env, kit_state(3));
        rig_step(&rig, NULL);
        if (is_pushed(before)) {
            assert_true(count < 8);
            found[count++] = (int)step;
        }
    }
    rig_close(&rig);
    return count;
}

/* Every 8 s, robots 0.97 s apart; none before the first step. */
TEST(schedule) {
    int found[8];
    assert_int_equal(find_pushes(0, 0, 810, found), 1);
    assert_int_equal(found[0], 800);
    assert_int_equal(find_pushes(1, 690, 30, found), 1);
    assert_int_equal(found[0], 703);
    assert_int_equal(find_pushes(2, 600, 10, found), 1);
    assert_int_equal(found[0], 606);
    open_in_the_air(0);
    rig.def.randomize.push_interval = 0;
    const double none[6] = {0};
    for (int t = 0; t < 20; t++) {
        rig_step(&rig, NULL);
        assert_memory_equal(rig.env->push, none, sizeof none);
    }
    rig_close(&rig);
}

/* A jump of the base's velocity: x and y +-0.4 m/s, about each axis +-0.6 rad/s, z none. */
TEST_WITH(size_and_independence, open_first, close_rig) {
    enum { PUSHES = 2000 };
    rig.def.randomize.push_interval = 0.01;
    double sum[6] = {0}, square[6] = {0}, product[6][6] = {{0}}, low[6] = {0}, high[6] = {0};
    for (int t = 0; t < PUSHES; t++) {
        kit_put(rig.env, kit_state(3));
        rig.env->step = 1;
        rig_step(&rig, NULL);
        for (int i = 0; i < 6; i++) {
            double x = rig.env->push[i];
            low[i] = fmin(low[i], x);
            high[i] = fmax(high[i], x);
            sum[i] += x;
            square[i] += x * x;
            for (int j = 0; j < i; j++) {
                product[i][j] += x * rig.env->push[j];
            }
        }
    }
    const double size[6] = {0.4, 0.4, 0, 0.6, 0.6, 0.6};
    for (int i = 0; i < 6; i++) {
        double a = size[i], sigma = a / sqrt(3);
        assert_true(low[i] >= -a && high[i] <= a);
        assert_true(low[i] <= -0.99 * a && high[i] >= 0.99 * a);
        expect_entry("mean push", i, sum[i] / PUSHES, 0, 4.5 * sigma / sqrt(PUSHES));
        expect_entry("variance", i, square[i] / PUSHES, sigma * sigma, 0.1 * sigma * sigma);
        for (int j = 0; j < i; j++) {
            expect_entry("correlation", i, product[i][j] / PUSHES, 0,
                         5 * sigma * size[j] / sqrt(3) / sqrt(PUSHES));
        }
    }
}

/* The push is added to the base's velocity before the step, then fades in the critic's view
 * only. */
TEST_WITH(push_is_a_velocity_jump, open_first, close_rig) {
    RobotState state = kit_moving_state(3, 4), pushed;
    rig.def.randomize.push_interval = 0.01;
    rig.env->step = 5;
    task_env_set_state(rig.env, &state);
    rig_step(&rig, NULL);
    pushed = task_env_state(rig.env);
    double push[6];
    memcpy(push, rig.env->push, sizeof push);
    for (int i = 0; i < 6; i++) {
        state.qvel[i] += push[i];
        expect_entry("critic", 70 + i, (double)rig.critic[70 + i], push[i], 1e-7);
    }
    rig.def.randomize.push_interval = 0;
    task_env_set_state(rig.env, &state);
    rig_step(&rig, NULL);
    state = task_env_state(rig.env);
    assert_memory_equal(&pushed, &state, sizeof pushed);
    for (int i = 0; i < 6; i++) {
        expect_entry("faded", i, rig.env->push[i], 0.95 * push[i], 1e-15);
        expect_entry("critic", 70 + i, (double)rig.critic[70 + i], 0.95 * push[i], 1e-7);
    }
}

/* ---- helping hand ---- */

static void help(double level, double draw) {
    rig.def.assist = 1;
    rig.env->assist_level = level;
    rig.env->assist_draw = draw;
}

static int hand(double yaw, double pitch, double roll, double wrench[6]) {
    RobotState state = kit_state(3);
    kit_turn(state.qpos, yaw, pitch, roll);
    memcpy(state.qvel, rig.env->robot.qvel, sizeof state.qvel);
    kit_load(rig.sim, &state, rig.env);
    return task_assist(rig.env, &rig.def, robot_table(robot), robot_sim_base_rotation(rig.sim),
                       robot_sim_qvel(rig.sim), wrench);
}

/* With a share of 0.4: half of 33.113 kg is 64.97 N; 100 N s/m up to 30 N; 300 N m/rad, 30 N m
 * s/rad.
 */
TEST_WITH(wrench_by_hand, open_first, close_rig) {
    static const struct {
        const char *what;
        double command[2], qvel[6], yaw, pitch, roll; /* qvel: angular in base axes */
        double fx, fy, tx, ty;
    } rows[] = {
        {"at rest, upright", {0}, {0}, 0, 0, 0, 0, 0, 0, 0},
        {"0.2 m/s missing", {0.2}, {0}, 0, 0, 0, 8, 0, 0, 0},
        {"at most 30 N", {-0.9}, {0}, 0, 0, 0, -12, 0, 0, 0},
        {"forward is along the heading", {0.2}, {0}, 0.5 * KIT_PI, 0, 0, 0, 8, 0, 0},
        {"left of the heading", {0, 0.1}, {0}, 0.5 * KIT_PI, 0, 0, -4, 0, 0, 0},
        {"against the speed", {0}, {0.1, -0.25, 3}, 0, 0, 0, -4, 10, 0, 0},
        {"leaning to the right", {0}, {0}, 0, 0, 0.1, 0, 0, -11.98001000, 0}, /* 120 sin 0.1 */
        {"leaning forward", {0}, {0}, 0, 0.1, 0, 0, 0, 0, -11.98001000},
        {"leaning forward, heading y", {0}, {0}, 0.5 * KIT_PI, 0.1, 0, 0, 0, 11.98001000, 0},
        {"against the turning", {0}, {0, 0, 0, 0.5, -0.25, 7}, 0, 0, 0, 0, 0, -6, 3},
        {"the same, heading y", {0}, {0, 0, 0, 0.5, -0.25, 7}, 0.5 * KIT_PI, 0, 0, 0, 0, -3, -6},
    };
    help(0.5, 0.8);
    double weight = 0.4 * 0.5 * 9.81 * robot_total_mass(robot), w[6];
    expect_near("half the weight", weight, 64.968, 2e-3);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        memcpy(rig.env->command, rows[i].command, sizeof rows[i].command);
        memcpy(rig.env->robot.qvel, rows[i].qvel, sizeof rows[i].qvel);
        assert_true(hand(rows[i].yaw, rows[i].pitch, rows[i].roll, w));
        const double wanted[6] = {rows[i].fx, rows[i].fy, weight, rows[i].tx, rows[i].ty, 0};
        for (int k = 0; k < 6; k++) {
            expect_entry(rows[i].what, k, w[k], wanted[k], 1e-6);
        }
    }
    rig.def.assist = 0;
    assert_false(hand(0, 0, 0, w));
    rig.def.assist = 1;
    rig.env->assist_level = 0;
    assert_false(hand(0, 0, 0, w));
}

/* In the air the whole robot falls with half of gravity, and with all of it alone. */
TEST_WITH(hand_acts_in_the_step, open_first, close_rig) {
    rig.env->command[0] = 0;
    for (int helped = 0; helped < 2; helped++) {
        kit_put(rig.env, kit_state(3));
        help(helped, 1);
        rig_step(&rig, NULL);
        const mjModel *m = robot_sim_model(rig.sim);
        mjData *d = mj_makeData(m);
        memcpy(d->qpos, robot_sim_qpos(rig.sim), sizeof(double) * SA01_NQ);
        memcpy(d->qvel, robot_sim_qvel(rig.sim), sizeof(double) * SA01_NV);
        mj_fwdPosition(m, d);
        mj_fwdVelocity(m, d);
        mj_subtreeVel(m, d);
        expect_near("fall in 10 ms", d->subtree_linvel[2], helped ? -0.04905 : -0.0981, 1e-3);
        mj_deleteData(d);
    }
}

/* 1.3 times the share of the way from the default pose to the reference. */
TEST_WITH(led_pose, open_first, close_rig) {
    const double *rest = robot_default_pose(robot);
    double pose[SA01_JOINTS];
    help(0.5, 0.8);
    rig.env->phase = 0.25; /* right leg bent by 0.4, 0.8, 0.4 */
    for (int i = 0; i < robot_joints(robot); i++) {
        pose[i] = task_assist_pose(rig.env, &rig.def, robot_table(robot), i);
    }
    for (int i = 0; i < SA01_JOINTS; i++) {
        double turn = i == 8 || i == 10 ? -0.208 : i == 9 ? 0.416 : 0;
        expect_entry("led pose", i, pose[i], rest[i] + turn, 1e-12);
    }
    rig.env->command[0] = 0;
    for (int i = 0; i < robot_joints(robot); i++) {
        pose[i] = task_assist_pose(rig.env, &rig.def, robot_table(robot), i);
    }
    assert_memory_equal(pose, rest, sizeof pose);
    rig.env->command[0] = 0.5;
    rig.def.assist = 0;
    for (int i = 0; i < robot_joints(robot); i++) {
        pose[i] = task_assist_pose(rig.env, &rig.def, robot_table(robot), i);
    }
    assert_memory_equal(pose, rest, sizeof pose);
}

/* Actions are added to the led pose. */
TEST_WITH(torque_follows_the_led_pose, open_first, close_rig) {
    task_env_rest(rig.env)->gains.kp[KNEE] = task_env_rest(rig.env)->gains.kp[LEG_JOINTS + KNEE] =
        10;
    rig.env->phase = 0.25;
    help(1, 0.5);
    RobotState before = task_env_state(rig.env);
    rig_step(&rig, NULL);
    double led = rig.env->robot.qvel[6 + 9], free_leg = rig.env->robot.qvel[6 + 3];
    assert_true(led > 0.05 && fabs(free_leg) < 0.3 * led);
    task_env_set_state(rig.env, &before);
    rig.env->phase = 0.25;
    rig.def.assist = 0;
    rig_step(&rig, NULL);
    assert_true(fabs(rig.env->robot.qvel[6 + 9]) < 0.01);
}

/* After 2 s on its feet a step takes 1/800 of the level; a fall makes it 1.3 times as much and 0.01
 * more, at most 1. */
TEST_WITH(level_of_help, open_first, close_rig) {
    TaskEnv *env = rig.env;
    env->assist_level = 0.5;
    env->step_first = 100;
    env->step = 300; /* 2.00 s */
    task_assist_adapt(env, &rig.def, 0);
    expect_near("within the grace", env->assist_level, 0.5, 0);
    env->step = 301;
    task_assist_adapt(env, &rig.def, 0);
    expect_near("later", env->assist_level, 0.499375, 1e-12);
    env->assist_level = 0.5;
    rig.def.assist_decay = 4;
    task_assist_adapt(env, &rig.def, 0);
    expect_near("twice as fast", env->assist_level, 0.49875, 1e-12);
    env->assist_level = 0.5;
    task_assist_adapt(env, &rig.def, 1);
    expect_near("a fall", env->assist_level, 0.66, 1e-12);
    env->assist_level = 0.9;
    task_assist_adapt(env, &rig.def, 1);
    expect_near("at most 1", env->assist_level, 1, 0);
    env->assist_level = 0;
    task_assist_adapt(env, &rig.def, 1);
    expect_near("from nothing", env->assist_level, 0.01, 1e-12);
    rig.def.assist = 1;
    env->assist_level = 0.5;
    env->assist_draw = 0.7;
    expect_near("share", task_assist_share(env, &rig.def), 0.35, 1e-12);
    rig.def.assist = 0;
    expect_near("off", task_assist_share(env, &rig.def), 0, 0);
}

/* The step adapts it: at a fall, with time on its feet, at a time-out not as at a fall. */
TEST_WITH(level_follows_the_episode, open_first, close_rig) {
    TaskEnv *env = rig.env;
    assert_true(env->assist_level == 1);
    env->assist_level = 0.5;
    rig_step(&rig, NULL);
    expect_near("young", env->assist_level, 0.5, 0);
    env->step = 500;
    kit_put(env, kit_state(3));
    rig_step(&rig, NULL);
    expect_near("on its feet", env->assist_level, 0.499375, 1e-12);
    env->step = env->step_limit - 1;
    kit_put(env, kit_state(3));
    assert_true(rig_step(&rig, NULL).timeout);
    expect_near("time-out", env->assist_level, 0.499375 * 0.99875, 1e-12);
    env->assist_level = 0.5;
    kit_turn(env->robot.qpos, 0, 1.3, 0);
    assert_true(rig_step(&rig, NULL).done);
    expect_near("fall", env->assist_level, 0.66, 1e-12);
}

TEST_MAIN(kit_setup, kit_teardown)
