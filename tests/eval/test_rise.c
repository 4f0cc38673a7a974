/* The Go1 on its back: policies/go1_rise.safetensors stands up on soft ground and on very hard
 * ground, the policy that walks does not, and the trial says which. */
#include "env/task/policy_keys.h"
#include "kit.h"
#include "learn/policy.h"
#include "mild/batch.h"
#include "run/eval/eval.h"

#define RISES MILD_SOURCE_DIR "/policies/go1_rise.safetensors"
#define WALKS MILD_SOURCE_DIR "/policies/go1.safetensors"

enum { TRIALS = 4 };

static Robot *robot;

static int setup(void **unused) {
    (void)unused;
    MildError error = {0};
    robot = robot_create(MILD_SOURCE_DIR "/robots/go1", &error);
    if (!robot) {
        fail_msg("%s", error.text);
    }
    robot_set_shells(robot, 1);
    return 0;
}

static int teardown(void **unused) {
    (void)unused;
    robot_destroy(robot);
    return 0;
}

/* Trials from the back, of the task that the policy's file says. */
static EvalRow lie(const char *file, const char *ground, EvalTrial each[TRIALS]) {
    MildError error = {0};
    TaskDef def = task_def_default();
    const EvalDef eval = {.trials = TRIALS, .seconds = 7, .seed = 5};
    Scene scene;
    EvalRow row;
    Controller controller;
    Pool *pool = pool_create(2);
    Policy *policy = policy_load(file, NULL, 0, &error);
    assert_non_null(policy);
    assert_int_equal(task_policy_keys_read(&def, policy_def(policy)->task, &error), MILD_OK);
    policy_destroy(policy);
    task_def_make_nominal(&def);
    def.physics_dt = 0.005;
    def.start = TASK_START_BACK;
    def.may_lie = 1;
    assert_int_equal(scene_make(&scene, ground, 1, &error), MILD_OK);
    scene_harden(&scene);
    assert_false(scene.rigid);
    assert_int_equal(controller_learned(file, robot, pool, TRIALS, &controller, &error), MILD_OK);
    const EvalRun run = {.task = &def,
                         .robot = robot,
                         .pool = pool,
                         .controller = &controller,
                         .device = MILD_BATCH_HOST,
                         .scenes = &scene,
                         .scene_count = 1,
                         .speeds = &eval.speed,
                         .speed_count = 1,
                         .eval = eval,
                         .each = each};
    assert_int_equal(eval_run(&run, &row, &error), MILD_OK);
    controller_destroy(&controller);
    pool_destroy(pool);
    char line[384];
    eval_print_row(&row, line, sizeof line);
    print_message("%s\n", line);
    return row;
}

/* It needs a second to come to rest, and comes up after that. Standing it carries itself on its
 * feet, so that its shells had little to do. */
static void it_rights_itself(void **unused) {
    (void)unused;
    static const char *const grounds[] = {"rigid", "foam45", "sand_dense"};
    EvalTrial each[TRIALS];
    for (int g = 0; g < 3; g++) {
        const EvalRow row = lie(RISES, grounds[g], each);
        assert_int_equal(row.start, TASK_START_BACK);
        assert_true(row.righted >= TRIALS - 1);
        assert_true(row.success == TRIALS && row.up > 1 && row.up < 5);
        for (int i = 0; i < TRIALS; i++) {
            assert_true(isnan(each[i].up) ||
                        (each[i].up > 1 && each[i].up < 5 && each[i].shells < 0.5));
        }
    }
}

/* It stays on the ground, where its shells carry it, and that ends no trial. */
static void the_walking_policy_does_not(void **unused) {
    (void)unused;
    EvalTrial each[TRIALS];
    const EvalRow row = lie(WALKS, "foam45", each);
    assert_true(row.righted == 0 && isnan(row.up) && row.success == TRIALS);
    for (int i = 0; i < TRIALS; i++) {
        assert_true(isnan(each[i].up) && each[i].end == TASK_END_time && each[i].shells > 0.5);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_rights_itself),
        cmocka_unit_test(the_walking_policy_does_not),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
