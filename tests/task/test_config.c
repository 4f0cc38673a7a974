/* What the task's keys do together: the nominal task, what is refused, gains and limits as texts;
 * and what a policy's file says of them, printed and read again, and refused. Defaults and ranges:
 * config/test_config. */
#include "env/task/policy_keys.h"
#include "task_kit.h"

/* What task_def_make_nominal leaves of a random key: [0] and, of a range, [1]. */
static const struct {
    const char *name;
    double value;
} still[] = {{"rigid_share", 0},  {"preset_share", 1}, {"preset_jitter", 0}, {"patch_share", 0},
             {"base_mass", 0},    {"com_offset", 0},   {"link_mass", 1},     {"armature", 1},
             {"motor_offset", 0}, {"gain", 1},         {"strength", 1},      {"push_interval", 0},
             {"shells_share", 1}, {"slip_share", 0}};

/* Those keys, the helping hand and driven joints have no effect, all others their defaults: noise,
 * latencies and the start are drawn. */
TEST(nominal) {
    TaskDef plain = task_def_default();
    TaskDef def = plain;
    def.randomize.shells_share = 0.5;
    task_def_make_nominal(&def);
    int changed = 0;
    for (int i = 0; i < randomize_field_count; i++) {
        const MildField *field = &randomize_fields[i];
        const char *at = (const char *)&def.randomize + field->offset;
        const double *values = (const double *)(const void *)at;
        size_t k = 0;
        while (k < sizeof still / sizeof *still && strcmp(still[k].name, field->name) != 0) {
            k++;
        }
        if (k == sizeof still / sizeof *still) {
            size_t bytes = field->type == MILD_FIELD_DOUBLE ? sizeof(double)
                           : field->type == MILD_FIELD_TEXT ? 1
                                                            : sizeof(int);
            assert_memory_equal(at, (const char *)&plain.randomize + field->offset,
                                bytes * (size_t)field->count);
            continue;
        }
        changed++;
        for (int n = 0; n < field->count; n++) {
            expect_entry(field->name, n, values[n], still[k].value, 0);
        }
    }
    assert_int_equal(changed, sizeof still / sizeof *still);
    assert_memory_equal(&def.reward, &plain.reward, sizeof def.reward);
    assert_int_equal(def.assist, 0);
    def.assist = plain.assist;
    expect_near("driven_share", def.driven_share, 0, 0);
    def.driven_share = plain.driven_share;
    def.randomize = plain.randomize;
    assert_memory_equal(&def, &plain, sizeof def);
}

static void check_bad_task(const TaskDef *def, const char *names) {
    MildError error = {0};
    assert_refused(task_def_check(def, &error), MILD_ERROR_RANGE, &error, names);
}

TEST(refused) {
    MildError error = {0};
    TaskDef def = task_def_default();
    assert_int_equal(task_def_check(&def, &error), MILD_OK);
    def.physics_dt = 0.003;
    check_bad_task(&def, "task.physics_dt 0.01 0.003");
    def = task_def_default();
    def.vx[0] = 2;
    check_bad_task(&def, "task.vx 2 1.2");
    def = task_def_default();
    def.tilt_limit = 4;
    check_bad_task(&def, "task.tilt_limit 4 0.1 3.1");
    def = task_def_default();
    def.reward.feet_range[0] = 0.5;
    check_bad_task(&def, "reward.feet_range 0.5 0");
    def = task_def_default();
    def.randomize.mu[1] = 0.1;
    check_bad_task(&def, "randomize.mu 0.2 0.1");
    def = task_def_default();
    def.randomize.rigid_share = 0.6;
    check_bad_task(&def, "rigid_share preset_share 1");
    def = task_def_default();
    def = task_def_default();
    def.shells_stand = 0; /* which a lying robot needs */
    def.start = TASK_START_BACK;
    check_bad_task(&def, "task.start task.shells_stand");
    def.start = TASK_START_STAND;
    def.may_lie = 1;
    check_bad_task(&def, "task.may_lie task.shells_stand");
    def = task_def_default();
    def.shells_stand = 0;
    def.randomize.rigid_share = 0.5;
    def.vx[0] = def.vx[1];
    assert_int_equal(task_def_check(&def, &error), MILD_OK);
}

/* The robot's gains; one for all; one leg's for both; a joint's each. */
TEST(gains) {
    static const struct {
        const char *text;
        double first, knee, right_knee, last;
    } cases[] = {{"robot", 50, 70, 70, 20},
                 {"30", 30, 30, 30, 30},
                 {"1 2 3 4 5 6", 1, 4, 4, 6},
                 {"1,2,3, 4 5 6 7 8 9 10 11 12.5", 1, 4, 10, 12.5}};
    for (int i = 0; i < 4; i++) {
        TaskDef def = task_def_default();
        TaskGains own;
        strcpy(def.kp, cases[i].text);
        assert_int_equal(task_def_check_robot(&def, robot, NULL), MILD_OK);
        assert_int_equal(task_gains(&def, robot, &own, NULL), MILD_OK);
        expect_entry("first", i, own.kp[0], cases[i].first, 0);
        expect_entry("knee", i, own.kp[KNEE], cases[i].knee, 0);
        expect_entry("right knee", i, own.kp[LEG_JOINTS + KNEE], cases[i].right_knee, 0);
        expect_entry("last", i, own.kp[11], cases[i].last, 0);
        expect_entry("kd", i, own.kd[ANKLE_PITCH], 0.2, 0);
    }
    static const char *const wrong[] = {"", "robots", "1 2 3 4 5", "501", "-1", "1 2 x"};
    for (int i = 0; i < 6; i++) {
        TaskDef def = task_def_default();
        MildError error = {0};
        strcpy(def.kp, wrong[i]);
        assert_refused(task_def_check_robot(&def, robot, &error), MILD_ERROR_RANGE, &error,
                       "task.kp");
        def = task_def_default();
        strcpy(def.kd, wrong[i]);
        assert_refused(task_def_check_robot(&def, robot, &error), MILD_ERROR_RANGE, &error,
                       "task.kd");
    }
}

/* A share of the effort: the same for all joints, or a leg's. */
TEST(torque_limits) {
    TaskDef def = task_def_default();
    TaskGains own;
    assert_int_equal(task_gains(&def, robot, &own, NULL), MILD_OK);
    expect_near("hip", own.limit[0], 0.85 * 140, 1e-12);
    expect_near("ankle", own.limit[ANKLE_PITCH], 0.85 * 24, 1e-12);
    strcpy(def.torque_share, "0.6 0.6 0.6 0.5 0.85 1");
    assert_int_equal(task_gains(&def, robot, &own, NULL), MILD_OK);
    expect_near("knee", own.limit[KNEE], 70, 1e-12);
    expect_near("right knee", own.limit[LEG_JOINTS + KNEE], 70, 1e-12);
    expect_near("right ankle", own.limit[11], 24, 1e-12);
    static const char *const wrong[] = {"", "robot", "0.6 0.6 0.6 0.6 0.6", "1.01", "0.09", "nan"};
    for (int i = 0; i < 6; i++) {
        MildError error = {0};
        strcpy(def.torque_share, wrong[i]);
        assert_refused(task_def_check_robot(&def, robot, &error), MILD_ERROR_RANGE, &error,
                       "task.torque_share");
    }
}

/* 0 takes the robot's; another number is the task's. */
TEST(robot_or_task) {
    TaskDef def = task_def_default();
    expect_near("action scale", task_action_scale(&def, robot_table(robot)), 0.5, 0);
    expect_near("height", task_nominal_height(&def, robot_table(robot)), 0.83, 0);
    def.action_scale = 0.25;
    def.reward.nominal_height = 0.7;
    expect_near("action scale", task_action_scale(&def, robot_table(robot)), 0.25, 0);
    expect_near("height", task_nominal_height(&def, robot_table(robot)), 0.7, 0);
}

/* ---- in a policy's file ---- */

#define SHARES "0.6 0.6 0.6 0.6 0.85 0.85"
#define GAINS "50 50 70 70 20 20 50 50 70 70 20 20"

/* All keys away from their defaults, and others too. */
static TaskDef changed(void) {
    TaskDef def = task_def_default();
    def.gait_period = 0.7;
    def.gait_slowing = 0.4;
    def.gait_slow_below = 0.9;
    def.standing_below = 0.2;
    def.clock = 0;
    def.history_stride = 3;
    def.velocity_scale = 2;
    def.height_scale = 5;
    def.action_scale = 0.3;
    def.action_clip = 7;
    strcpy(def.torque_share, SHARES);
    def.torque_hold = 1;
    def.speed_hold = 0.3;
    def.speed_hold_most = 3.6;
    strcpy(def.kp, GAINS);
    strcpy(def.kd, "1.5");
    def.physics_dt = 0.001;
    return def;
}

TEST(printed_and_read) {
    char text[1024];
    MildError error = {0};
    TaskDef from = changed(), to = task_def_default();
    task_policy_keys_print(&from, text, sizeof text);
    assert_int_equal(task_policy_keys_read(&to, text, &error), MILD_OK);
    from.physics_dt = task_def_default().physics_dt; /* no matter of the policy's */
    assert_memory_equal(&to, &from, sizeof to);
    assert_int_equal(task_policy_keys_read(&to, "shell_depth = 0.06; clock = true", &error),
                     MILD_OK);
    assert_true(to.clock == 1); /* the key before it has no effect any more */
    to = changed();
    assert_int_equal(task_policy_keys_read(&to, "", &error), MILD_OK); /* an older file */
    assert_true(to.gait_period == 0.7 && to.clock == 0);
}

/* The longest values have room in a policy's file; where they have not, nothing is printed. */
TEST(lengths) {
    char text[1024];
    TaskDef def = changed();
    memset(def.kp, '1', sizeof def.kp - 1);
    memset(def.kd, '2', sizeof def.kd - 1);
    def.kp[sizeof def.kp - 1] = def.kd[sizeof def.kd - 1] = '\0';
    task_policy_keys_print(&def, text, sizeof text);
    assert_true(strlen(text) > 2 * sizeof def.kp - 2);
    assert_string_equal(text + strlen(text) - strlen(def.kd), def.kd);
    const size_t whole = strlen(text);
    for (size_t size = 1; size <= whole; size++) {
        task_policy_keys_print(&def, text, size);
        assert_string_equal(text, "");
    }
}

TEST(refused_of_a_file) {
    static const struct {
        const char *text;
        MildStatus status;
        const char *names;
    } texts[] = {
        {"gait_perion = 1", MILD_ERROR_FORMAT, "gait_perion 1"},
        {"physics_dt = 0.001", MILD_ERROR_FORMAT, "physics_dt 0.001"},
        {"clock = true; ; clock = true", MILD_ERROR_FORMAT, "key"},
        {"gait_period=1", MILD_ERROR_FORMAT, "gait_period=1"},
        {"gait_period = nan", MILD_ERROR_ARGUMENT, "task.gait_period nan"},
        {"gait_period = -1", MILD_ERROR_RANGE, "task.gait_period -1 0.2 3"},
        {"clock = 2", MILD_ERROR_ARGUMENT, "task.clock 2"},
        {"kp = 1 2", MILD_OK, NULL}, /* a number a joint; the robot says how many */
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        TaskDef def = task_def_default();
        MildError error = {0};
        assert_int_equal(task_policy_keys_read(&def, texts[i].text, &error), texts[i].status);
        if (texts[i].status != MILD_OK) {
            assert_error(&error, texts[i].status, texts[i].names);
        }
    }
    char text[2000];
    TaskDef def = task_def_default();
    MildError error = {0};
    memset(text, '1', sizeof text - 1);
    text[sizeof text - 1] = '\0';
    memcpy(text, "kp = ", 5);
    assert_int_not_equal(task_policy_keys_read(&def, text, &error), MILD_OK);
}

TEST_MAIN(kit_setup, kit_teardown)
