/* Gait clock, standing commands, runs and other gaits, by hand (docs/task.md section 7). Schedule,
 * wanted height and reference motion of a walk: test_widest.c. */
#include "sa01.h"

#include "task_kit.h"

TEST(standing_commands) {
    TaskDef def = task_def_default();
    const double none[TASK_COMMANDS] = {0}, small[TASK_COMMANDS] = {0.0999, -0.0999, 0.0999};
    assert_true(task_is_standing(&def, none));
    assert_true(task_is_standing(&def, small));
    for (int i = 0; i < 3; i++) {
        for (int sign = -1; sign <= 1; sign += 2) {
            double command[TASK_COMMANDS] = {0};
            command[i] = 0.1001 * sign;
            assert_false(task_is_standing(&def, command));
        }
    }
    def.standing_below = 0.05;
    assert_true(task_is_standing(&def, none));
    assert_false(task_is_standing(&def, small));
    def.standing_below = 0; /* the robot always walks */
    assert_false(task_is_standing(&def, none));
}

/* T = 0.8 (1 + 0.5 (1 - v/1.2)) s by hand, below 1.2 m/s and above. */
TEST(slow_clock) {
    const struct {
        double command[TASK_COMMANDS], period;
    } rows[] = {{{0, 0, 0}, 1.2},        {{0.3, 0, 0}, 1.1},  {{-0.6, 0, 0}, 1.0},
                {{0, 0.2, 0}, 1.0},      {{0, -0.1, 0}, 1.1}, {{0, 0, 0.9}, 0.9},
                {{0.3, 0.1, -0.3}, 0.9}, {{1.2, 0, 0}, 0.8},  {{-1.3, 0, 0}, 0.8},
                {{0.3, 0.3, 0.6}, 0.8}};
    TaskDef def = task_def_default();
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        def.gait_slowing = 0;
        expect_near("as it is", task_gait_period(&def, rows[i].command), 0.8, 0);
        def.gait_slowing = 0.5;
        expect_entry("slow", (int)i, task_gait_period(&def, rows[i].command), rows[i].period,
                     1e-12);
    }
    def.gait_slow_below = 0.6;
    const double command[TASK_COMMANDS] = {0.3};
    expect_near("below", task_gait_period(&def, command), 1.0, 1e-12);
}

static const double ahead[TASK_COMMANDS] = {0.6};

static TaskFoot foot_at(const TaskDef *def, double phase, const double *command, int foot) {
    return task_gait_foot(def, robot_table(robot), phase, command, foot);
}

/* Of a run the same, in stance for share = 0.35 - by hand: s = (phase - lift-off)/0.65, and half of
 * the speeds between a walk and a run have a share of 0.425. */
TEST(run) {
    TaskDef def = task_def_default();
    const double fast[TASK_COMMANDS] = {3}, half[TASK_COMMANDS] = {-2};
    def.stance_share[0] = 0.35;
    expect_near("walk", task_gait_share(&def, ahead), 0.5, 0);
    expect_near("between", task_gait_share(&def, half), 0.425, 1e-12);
    expect_near("run", task_gait_share(&def, fast), 0.35, 1e-12);
    int flight = 0, stance = 0;
    for (int k = 0; k < 1000; k++) {
        const int left = foot_at(&def, (k + 0.5) / 1000, fast, SA01_LEFT).stance;
        const int right = foot_at(&def, (k + 0.5) / 1000, fast, SA01_RIGHT).stance;
        assert_false(left && right);
        assert_int_equal(left, k < 350);
        assert_int_equal(right, k >= 500 && k < 850);
        flight += !left && !right;
        stance += left;
    }
    assert_int_equal(flight, 300); /* 1 - 2 share */
    assert_int_equal(stance, 350);
    expect_near("left", foot_at(&def, 0.675, fast, SA01_LEFT).height, 0.1, 1e-12); /* s = 1/2 */
    expect_near("right", foot_at(&def, 0.175, fast, SA01_RIGHT).height, 0.1, 1e-12);
    expect_near("bend", foot_at(&def, 0.35 + 0.65 / 6, fast, SA01_LEFT).bend, 0.5, 1e-9);
    def.run_speed[0] = def.run_speed[1] = 2; /* at once */
    expect_near("at once", task_gait_share(&def, half), 0.35, 0);
    expect_near("below", task_gait_share(&def, (const double[TASK_COMMANDS]){1.999, 0, 0}), 0.5, 0);
}

/* Both feet of a hop do the same; a skip has no mirror image. */
TEST(other_gaits) {
    TaskDef def = task_def_default();
    for (def.gait = 1; task_gait_names[def.gait][0] != 'h'; def.gait++) {
    }
    assert_int_equal(task_set_robot(&def, robot, NULL), MILD_OK);
    assert_true(robot_mirror_shift(robot) == 0);
    for (double phase = 0.01; phase < 1; phase += 0.1) {
        const TaskFoot left = foot_at(&def, phase, ahead, SA01_LEFT);
        const TaskFoot right = foot_at(&def, phase, ahead, SA01_RIGHT);
        assert_memory_equal(&left, &right, sizeof left);
        assert_int_equal(left.stance, phase < 0.5);
    }
    def.gait++;
    assert_int_equal(task_set_robot(&def, robot, NULL), MILD_OK);
    assert_true(robot_mirror_shift(robot) == -1);
    def.gait = 0;
    assert_int_equal(task_set_robot(&def, robot, NULL), MILD_OK);
    assert_true(robot_mirror_shift(robot) == 0.5);
}

/* Jumps (docs/task.md section 7): clock, reward and growth by hand, and that a task without them is
 * what it was. */

#define STANCE 0.6  /* [s] */
#define RISE 0.4905 /* [m] of a flight of 2 sqrt(2 h/g) = 0.632456 s */
#define FLIGHT 0.6324555320336759
#define PERIOD (STANCE + FLIGHT)

static TaskDef jump_def(void) {
    TaskDef def = kit_quiet_def();
    def.jump[0] = 0.1;
    def.jump[1] = 0.5;
    def.jump_stance = STANCE;
    def.gait = 4; /* hop */
    return def;
}

/* Both feet stand for jump_stance, then fly as long as free fall does. */
TEST(clock_of_a_jump) {
    const TaskDef def = jump_def();
    const double jump[TASK_COMMANDS] = {0, 0, 0, RISE}, stand[TASK_COMMANDS] = {0};
    assert_false(task_is_standing(&def, jump));
    assert_true(task_is_standing(&def, stand));
    expect_near("period", task_gait_period(&def, jump), PERIOD, 1e-12);
    expect_near("share", task_gait_share(&def, jump), STANCE / PERIOD, 1e-12);
    expect_near("no jump", task_jump_flight(stand), 0, 0);
}

/* A robot that stands begins its jump with the stance, whenever the command comes. */
TEST(a_jump_begins_with_its_stance) {
    const TaskDef def = jump_def();
    Rig rig;
    rig_open(&rig, &def, 3, 0);
    rig_start(&rig, 0, 0, 0);
    for (int t = 0; t < 7; t++) {
        rig_step(&rig, NULL);
        expect_near("phase", rig.env->phase, 0, 0);
    }
    rig.env->command[TASK_RISE] = RISE;
    rig_step(&rig, NULL); /* the command is seen one step late */
    expect_near("phase", rig.env->phase, 0, 0);
    rig_step(&rig, NULL);
    expect_near("phase", rig.env->phase, TASK_PERIOD / PERIOD, 1e-12);
    expect_near("seen", (double)rig.frame[9 + 3 * SA01_JOINTS], 5 * RISE, 1e-6);
    rig_close(&rig);
}

/* Half way up in time the base has three quarters of the rise: exp(-|e|/0.05) of what lacks. */
TEST(reward_of_a_jump) {
    TaskDef def = jump_def();
    TaskEnv env = {.command = {0, 0, 0, RISE}};
    TaskMotion motion = {.def = &def, .env = &env, .robot = robot_table(robot)};
    env.shape = task_shape(&def, robot);
    const struct {
        double time, rise, wanted; /* [s] of the flight, [m], [-] */
    } rows[] = {{0.25, 0.75 * RISE, 1},
                {0.5, RISE, 1},
                {0.5, RISE - 0.05, 0.36787944},
                {0.5, RISE + 0.1, 0.13533528},
                {0.75, 0.75 * RISE, 1}};
    def.reward.tracking_narrow = 0.25, def.reward.tracking_sharpness = 3;
    def.reward.tracking_width = 0.2;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        env.phase = (STANCE + rows[i].time * FLIGHT) / PERIOD;
        motion.rise = rows[i].rise;
        expect_entry("jump", (int)i, reward_jump(&motion), rows[i].wanted, 1e-7);
    }
    /* 0.3 m/s too fast: 0.75 exp(-0.27) + 0.25 exp(-1.5) of the last row. */
    env.command[TASK_FORWARD] = 0.4;
    env.smooth_velocity[0] = 0.7;
    expect_near("speed", reward_jump(&motion), 0.62831716, 1e-7);
    env.phase = 0.9 * STANCE / PERIOD;
    expect_near("in stance", reward_jump(&motion), 0, 0);
    env.command[TASK_RISE] = 0;
    env.phase = 0.9;
    expect_near("without a jump", reward_jump(&motion), 0, 0);
}

/* The highest rise asked for grows by a step after a jump that reached four fifths, and falls where
 * it had less than half. Easy ones say nothing. */
TEST(jumps_that_grow) {
    static const double rows[][3] = {/* rise asked for, reached, by how much the highest grows */
                                     {0.20, 0.17, 0.025},
                                     {0.20, 0.15, 0},
                                     {0.20, 0.09, -0.025},
                                     {0.10, 0.10, 0}};
    Rig rig;
    TaskDef def = jump_def();
    def.jump_start = 0.1;
    def.standing_share = def.backward_share = 0;
    def.vx[0] = 0.1;
    def.vx[1] = 2; /* of which a robot has the share that its rise has of 0.5 m: 0.4 m/s */
    rig_open(&rig, &def, 11, 0);
    task_env_reset(rig.env, &rig.def, robot, rig.sim, &rig.view);
    expect_near("a new robot", rig.env->command_most, 0.1, 0);
    assert_true(rig.env->command[TASK_RISE] <= 0.1 && rig.env->command[TASK_RISE] > 0);
    assert_true(rig.env->command[TASK_FORWARD] > 0.1 && rig.env->command[TASK_FORWARD] <= 0.4);
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        rig.env->command_most = 0.2;
        rig.env->command[TASK_RISE] = rows[k][0];
        rig.env->risen[1] = rows[k][1];
        rig.env->phase = 0.1;
        rig.env->step = (uint32_t)(rig.def.command_interval / TASK_PERIOD + 0.5) - 1;
        rig.env->step_first = 0;
        rig_step(&rig, NULL);
        expect_entry("growth", (int)k, rig.env->command_most - 0.2, rows[k][2], 1e-12);
        assert_true(rig.env->command[TASK_RISE] <= rig.env->command_most);
        assert_true(rig.env->command[TASK_RISE] >= def.jump[0]);
        assert_true(rig.env->command[TASK_FORWARD] <= 4 * rig.env->command_most);
    }
    rig_close(&rig);
}

/* What the base rises in a period is kept until the next one ends. */
TEST(rise_of_a_period) {
    const TaskDef def = jump_def();
    Rig rig;
    rig_open(&rig, &def, 3, 0);
    rig_start(&rig, 0, 0, 0);
    rig.env->command[TASK_RISE] = rig.env->command_seen[TASK_RISE] = RISE;
    rig.env->phase = 0.5;
    rig.env->risen[0] = 0.3;
    rig.env->risen[1] = 0.1;
    rig_step(&rig, NULL);
    assert_true(rig.env->risen[0] == 0.3 && rig.env->risen[1] == 0.1);
    rig.env->phase = 1 - 0.5 * TASK_PERIOD / PERIOD;
    rig_step(&rig, NULL);
    assert_true(rig.env->risen[0] == 0 && rig.env->risen[1] == 0.3);
    rig_close(&rig);
}

/* Its observation has one number more, which a mirror keeps. */
TEST(a_task_without_jumps_sees_none) {
    const TaskDef with = jump_def(), without = kit_quiet_def();
    const int width = task_shape(&without, robot).observation;
    assert_int_equal(task_shape(&with, robot).observation, width + 1);
    const TaskMirror image = task_mirror(&with, robot);
    assert_int_equal(image.observation_index[width - 2], width - 2);
    expect_near("sign", (double)image.observation_sign[width - 2], 1, 0);
}

TEST_MAIN(kit_setup, kit_teardown)
