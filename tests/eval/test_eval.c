/* Scenes by name, and the measures on a robot that stands: what must be zero is zero. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "eval/eval.h"

static void scenes_by_name(void **state) {
    (void)state;
    Scene scene;
    MildError error = {0};
    char name[64];
    assert_int_equal(scene_make(&scene, "rubber+foam45+sand_loose", 2, &error), MILD_OK);
    assert_string_equal(scene_ground_at(&scene, -3, 0, name, sizeof name), "rubber");
    assert_string_equal(scene_ground_at(&scene, 1.99, 0, name, sizeof name), "rubber");
    assert_string_equal(scene_ground_at(&scene, 2.01, 0, name, sizeof name), "foam45");
    assert_string_equal(scene_ground_at(&scene, 40, 0, name, sizeof name), "sand_loose");
    assert_int_equal(scene_make(&scene, "rigid", 2, &error), MILD_OK);
    assert_true(scene.rigid);
    assert_int_equal(scene_make(&scene, "rubber+foam54", 2, &error), MILD_ERROR_ARGUMENT);
    assert_non_null(strstr(error.text, "foam54"));
    assert_non_null(strstr(error.text, "foam45"));
    assert_int_not_equal(scene_make(&scene, "", 2, &error), MILD_OK);
    assert_int_not_equal(scene_make(&scene, "rubber+", 2, &error), MILD_OK);
}

/* The paper's gains do not balance (docs/task.md section 3): a policy of zeros must fall, and be
 * counted as fallen. */
static void zero_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    (void)self;
    (void)envs;
    memset(actions, 0, sizeof *actions * (size_t)rows * TASK_ACTIONS);
}

static void zero_destroy(void *self) {
    (void)self;
}

static void zero_action_falls_and_is_counted(void **state) {
    (void)state;
    MildError error = {0};
    Robot *robot = robot_create(MILD_SOURCE_DIR "/models/sa01/sa01.xml", &error);
    assert_non_null(robot);
    TaskDef def = task_def_default();
    task_def_make_nominal(&def);
    Controller zero = {&def, "zero", zero_act, zero_destroy};
    EvalDef eval = {.speed = 0.3, .trials = 4, .seconds = 6, .seed = 1};
    EvalRow first, again;
    Scene scene;
    assert_int_equal(scene_make(&scene, "foam28", 2, &error), MILD_OK);
    for (int threads = 1; threads <= 2; threads++) {
        Pool *pool = pool_create(threads);
        EvalRow *row = threads == 1 ? &first : &again;
        memset(row, 0, sizeof *row);
        assert_int_equal(eval_run(&def, robot, pool, &zero, &scene, &eval, row, &error), MILD_OK);
        pool_destroy(pool);
    }
    char line[256];
    eval_print_row(&first, line, sizeof line);
    printf("%s\n", line);
    assert_int_equal(first.success, 0);
    assert_true(first.seconds > 0.2 && first.seconds < 6);
    assert_true(first.torque_max > 0 && first.torque_max <= 0.85 * 140 + 1e-9);
    assert_memory_equal(&first, &again, sizeof first);
    robot_destroy(robot);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scenes_by_name),
        cmocka_unit_test(zero_action_falls_and_is_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
