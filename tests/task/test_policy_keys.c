/* What a policy's file says of how it walks: printed and read again, and refused. */
#include "env/task/policy_keys.h"
#include "kit.h"

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

TEST(refused) {
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

TEST_MAIN(NULL, NULL)
