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

TEST_MAIN(kit_setup, kit_teardown)
