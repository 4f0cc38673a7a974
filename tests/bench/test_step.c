/* The benchmark of a step. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "run/bench/record.h"
#include "run/bench/step.h"

/* The benchmark runs and reports positive times; how long they are is not a test's business. */
static void test_bench(void **unused) {
    (void)unused;
    RobotBench bench = {0};
    MildError error = {0};
    const ExperimentDef def = experiment_def_default();
    Robot *robot = bench_robot(&def, &error);
    assert_non_null(robot);
    assert_int_equal(robot_bench_step(robot, "foam60", 0.0025, 3, 20, &bench, &error), MILD_OK);
    assert_true(bench.engine_free > 0 && bench.engine_rigid > 0 && bench.rigid > 0 &&
                bench.newton > 0);
    assert_true(bench.gauss_seidel > 0 && bench.newton_phases.ground > 0 && bench.iterations >= 1);
    assert_int_not_equal(robot_bench_step(robot, "no_such_ground", 0.0025, 3, 20, &bench, &error),
                         MILD_OK);
    assert_non_null(strstr(error.text, "no_such_ground"));
    robot_destroy(robot);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_bench)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
