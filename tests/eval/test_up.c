/* When a robot is up again, by a script of heights and tilts, and how a row counts it. */
#include "kit.h"
#include "run/eval/eval.h"

enum { FEET = 4 };

/* A power of two: sums of it are exact. */
#define DT (1.0 / 1024)
#define STEPS(seconds) ((int)((seconds)*1024))

/* Nominal height 0.8 m, soles 0.1 m deep. It lies on its side for 2 s, then stands at 0.58 m over
 * its soles (72 %) for `up` s, in one step of which, at `dip` s, it is at 0.54 m (68 %) or tilts by
 * 0.31 rad, if dip is not 0. */
static Measure script_rise(double up, double dip, int tilts) {
    EnvsSample sample = {.feet = FEET, .quaternion = {1}};
    Measure m;
    measure_start(&m, DT);
    m.nominal_height = 0.8;
    for (int f = 0; f < FEET; f++) {
        sample.foot[f].height = -0.1;
    }
    for (int k = 1; k <= STEPS(2 + up); k++) {
        const int lies = k <= STEPS(2), dips = dip > 0 && k == STEPS(dip);
        const double roll = lies ? 1.5 : dips && tilts ? 0.31 : 0.29;
        sample.quaternion[0] = cos(0.5 * roll);
        sample.quaternion[1] = sin(0.5 * roll);
        sample.above = dips && !tilts ? 0.44 : 0.48;
        measure_sample(&m, &sample);
    }
    return m;
}

/* It stands all the time. */
static Measure script_standing(double seconds) {
    EnvsSample sample = {.feet = FEET, .quaternion = {1}, .above = 0.8};
    Measure m;
    measure_start(&m, DT);
    m.nominal_height = 0.8;
    for (int k = 0; k < STEPS(seconds); k++) {
        measure_sample(&m, &sample);
    }
    return m;
}

/* Up is who stands for the last two seconds; when it came up is the start of the unbroken time. */
TEST(up_at_the_end_and_for_two_seconds) {
    Measure m = script_rise(2.5, 0, 0);
    assert_true(fabs(measure_up(&m) - (2 + DT)) < 1e-9);
    m = script_rise(1.9, 0, 0);
    assert_true(isnan(measure_up(&m)));
    m = script_standing(2.5); /* from its first step on */
    assert_true(fabs(measure_up(&m) - DT) < 1e-9);
    m = script_standing(0);
    assert_true(isnan(measure_up(&m)));
    m = script_rise(5, 4, 0);
    assert_true(fabs(measure_up(&m) - (4 + DT)) < 1e-9);
    m = script_rise(5, 4, 1);
    assert_true(fabs(measure_up(&m) - (4 + DT)) < 1e-9);
    m = script_rise(5, 6, 1);
    assert_true(isnan(measure_up(&m)));
    m = script_rise(5, 6.99, 0); /* not at the end */
    assert_true(isnan(measure_up(&m)));
}

/* Three of four were up; one of them ended by a joint, so that two were righted, after 2.01 and
 * 4.01 s. */
TEST(a_row_counts_who_was_righted) {
    Measure m[4] = {script_rise(3, 0, 0), script_rise(5, 4, 0), script_rise(1, 0, 0),
                    script_rise(3, 0, 0)};
    const uint8_t ends[4] = {TASK_END_time, TASK_END_time, TASK_END_time, TASK_END_joint};
    const EvalDef eval = {.trials = 4, .seconds = 5, .start = TASK_START_BACK};
    MildError error = {0};
    EvalRow row;
    char line[384];
    assert_int_equal(eval_summarise(&row, "foam45", &eval, m, ends, 100, &error), MILD_OK);
    assert_int_equal(row.righted, 2);
    assert_int_equal(row.success, 3);
    assert_true(fabs(row.up - (3 + DT)) < 1e-9);
    eval_print_row(&row, line, sizeof line);
    assert_non_null(strstr(line, "  2/4 "));
    assert_non_null(strstr(line, "  up after 3.0 s"));
    assert_non_null(strstr(line, "1 joint"));
    row.start = TASK_START_STAND;
    eval_print_row(&row, line, sizeof line);
    assert_non_null(strstr(line, "  3/4 "));
    assert_null(strstr(line, "up after"));
}

TEST_MAIN(NULL, NULL)
