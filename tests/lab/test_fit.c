/* Parameters from noisy presses: they come back, their intervals hold the truth as often as they
 * say, and what the data cannot tell is named. Every noise is seeded; the seeds are printed. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/random.h"
#include "lab/fit.h"

enum { ROWS = 1000, SEEDS = 5, DRAWS = 200 };
typedef enum {
    NOISE_OF_PEAK,
    NOISE_OF_ROW
} Noise; /* the same on every row, or in proportion to its force */

static FitPoint points[2 * ROWS];

static FitDef plate(const char *ground) {
    FitDef def = {.elements = 55, .pitch = 0.0195, .free = {[FIT_K_PEN] = 1, [FIT_SIGMA_CONE] = 1}};
    assert_true(mild_material_preset(ground, &def.material));
    return def;
}

/* A press of the true ground to `depth` with noise of 2 %. */
static void press(const FitDef *truth, FitPoint *out, int rows, double depth, double speed,
                  Noise noise, uint64_t seed) {
    Random random = random_at(seed, (uint32_t)noise, 0);
    double peak = 0;
    for (int i = 0; i < rows; i++) {
        out[i] = (FitPoint){.time = NAN, .depth = depth * (i + 1) / rows, .speed = speed};
        out[i].force = fit_force(truth, &out[i]);
        peak = fmax(peak, out[i].force);
    }
    for (int i = 0; i < rows; i++) {
        out[i].force +=
            0.02 * (noise == NOISE_OF_PEAK ? peak : out[i].force) * random_normal(&random);
    }
}

static FitResult run(const FitDef *def, int count) {
    FitResult result;
    MildError error = {0};
    if (fit_run(def, points, count, &result, &error) != MILD_OK) {
        fail_msg("%s", error.text);
    }
    return result;
}

/* Start values of the fitted parameters far from the truth. */
static FitDef spoiled(const FitDef *truth) {
    FitDef def = *truth;
    def.material.k_pen *= 5;
    def.material.sigma_cone *= 0.1;
    return def;
}

static void recovery(void **state) {
    (void)state;
    double worst[2] = {0, 0};
    for (int g = 0; g < mild_material_preset_count(); g++) {
        for (int run_index = 0; run_index < 2 * SEEDS; run_index++) {
            FitDef truth = plate(mild_material_preset_name(g)), def = spoiled(&truth);
            press(&truth, points, ROWS, 0.04, 0.01, (Noise)(run_index % 2),
                  (uint64_t)(1 + run_index / 2));
            FitResult result = run(&def, ROWS);
            for (int p = 0; p < 2; p++) {
                double value = *fit_value(&truth.material, (FitName)p);
                assert_int_equal(result.parameter[p].state, FIT_FITTED);
                worst[p] = fmax(worst[p], fabs(result.parameter[p].value / value - 1));
            }
            assert_true(result.residual_share > 0.01 && result.residual_share < 0.05);
        }
    }
    printf("2 %% noise, seeds 1 .. %d: worst error k_pen %.2f %%, sigma_cone %.2f %%\n", SEEDS,
           100 * worst[0], 100 * worst[1]);
    assert_true(worst[0] < 0.05 && worst[1] < 0.05);
}

/* Without noise the truth comes back, also the shape and the drag, and the intervals shrink to
 * nothing. */
static void exact(void **state) {
    (void)state;
    double worst = 0;
    for (int g = 0; g < mild_material_preset_count(); g++) {
        FitDef truth = plate(mild_material_preset_name(g)), def = spoiled(&truth);
        def.material.alpha = 0.7;
        def.free[FIT_ALPHA] = 1;
        def.free[FIT_C_D] = truth.material.c_g > 0;
        def.material.c_d = def.free[FIT_C_D] ? 5 : 1;
        for (int half = 0; half < 2; half++) {
            press(&truth, points + half * ROWS, ROWS, 0.04, half ? 1 : 0.01, NOISE_OF_ROW, 1);
        }
        for (int i = 0; i < 2 * ROWS; i++) {
            points[i].force = fit_force(&truth, &points[i]);
        }
        FitResult result = run(&def, 2 * ROWS);
        for (int p = 0; p < FIT_PARAMETERS; p++) {
            double value = *fit_value(&truth.material, (FitName)p);
            worst = fmax(worst, fabs(result.parameter[p].value / value - 1));
            assert_int_equal(result.parameter[p].state, def.free[p] ? FIT_FITTED : FIT_HELD);
        }
    }
    printf("no noise, four parameters: worst error %.1e\n", worst);
    assert_true(worst < 1e-4);
}

/* Share of draws whose interval holds the truth: 95 % with a standard deviation of 1.5 % for 200
 * draws. */
static void cover(const char *ground, int shape, int rows, Noise noise) {
    int inside[FIT_PARAMETERS] = {0};
    for (int draw = 0; draw < DRAWS; draw++) {
        FitDef truth = plate(ground), def = spoiled(&truth);
        def.free[FIT_ALPHA] = shape;
        press(&truth, points, rows, 0.04, 0.01, noise, (uint64_t)(1000 + draw));
        FitResult result = run(&def, rows);
        for (int p = 0; p < 2 + shape; p++) {
            double value = *fit_value(&truth.material, (FitName)p);
            inside[p] += result.parameter[p].low <= value && value <= result.parameter[p].high;
        }
    }
    for (int p = 0; p < 2 + shape; p++) {
        double share = (double)inside[p] / DRAWS;
        printf("%s, %d rows, noise of %s, seeds 1000 ..: %s inside in %.1f %% of %d\n", ground,
               rows, noise == NOISE_OF_PEAK ? "peak" : "row", fit_names[p], 100 * share, DRAWS);
        assert_true(share >= 0.905 && share <= 0.99);
    }
}

static void coverage(void **state) {
    (void)state;
    cover("sand_loose", 0, 200, NOISE_OF_PEAK);
    cover("sand_loose", 0, 200, NOISE_OF_ROW);
    cover("foam45", 0, 40, NOISE_OF_PEAK);
    cover("sand_dense", 1, 200, NOISE_OF_ROW);
}

static void inseparable(void **state) {
    (void)state;
    FitDef truth = plate("grass"), def = truth;
    def.free[FIT_ALPHA] = def.free[FIT_NU] = def.free[FIT_C_D] = 1;
    press(&truth, points, ROWS, 0.04, 0.01, NOISE_OF_ROW, 7);
    FitResult result = run(&def, ROWS);
    assert_int_equal(result.parameter[FIT_NU].state, FIT_TIED);
    assert_int_equal(result.parameter[FIT_NU].partner, FIT_ALPHA);
    assert_true(result.parameter[FIT_NU].value == truth.material.nu);
    assert_int_equal(result.parameter[FIT_ALPHA].state, FIT_FITTED);
    assert_int_equal(result.parameter[FIT_C_D].state, FIT_NO_SPEEDS);
    assert_true(result.parameter[FIT_C_D].value == truth.material.c_d);

    /* a shallow press sees one stiffness only */
    def = truth = plate("rubber");
    press(&truth, points, 50, 0.002, 0.01, NOISE_OF_PEAK, 8);
    result = run(&def, 50);
    printf("2 mm deep: sigma_cone and k_pen tied, correlation %.3f\n",
           result.parameter[FIT_SIGMA_CONE].correlation);
    assert_int_equal(result.parameter[FIT_SIGMA_CONE].state, FIT_TIED);
    assert_int_equal(result.parameter[FIT_SIGMA_CONE].partner, FIT_K_PEN);
    assert_true(result.parameter[FIT_SIGMA_CONE].value == truth.material.sigma_cone);
    assert_int_equal(result.parameter[FIT_K_PEN].state, FIT_FITTED);

    /* foam has no added mass: no speed tells c_d */
    def = truth = plate("foam45");
    def.free[FIT_C_D] = 1;
    press(&truth, points, ROWS, 0.04, 0.01, NOISE_OF_ROW, 9);
    press(&truth, points + ROWS, ROWS, 0.04, 1, NOISE_OF_ROW, 10);
    assert_int_equal(run(&def, 2 * ROWS).parameter[FIT_C_D].state, FIT_NO_MASS);
}

static void drag(void **state) {
    (void)state;
    FitDef truth = plate("sand_loose"), def = spoiled(&truth);
    def.material.c_d = 1;
    def.free[FIT_C_D] = 1;
    press(&truth, points, ROWS, 0.04, 0.01, NOISE_OF_ROW, 11);
    press(&truth, points + ROWS, ROWS, 0.04, 1, NOISE_OF_ROW, 12);
    FitResult result = run(&def, 2 * ROWS);
    const FitParameter *c_d = &result.parameter[FIT_C_D];
    printf("two speeds: c_d %.2f in %.2f .. %.2f (17.2)\n", c_d->value, c_d->low, c_d->high);
    assert_int_equal(c_d->state, FIT_FITTED);
    assert_true(fabs(c_d->value / 17.2 - 1) < 0.05);
}

/* Down, up, down deeper: what counts is the way down on virgin ground; the speed comes from the
 * times. */
static void loading(void **state) {
    (void)state;
    static const double depths[] = {-0.001, 0,     0.001, 0.002, 0.003, 0.002,
                                    0.001,  0.002, 0.003, 0.004, 0.005, 0.004};
    enum { COUNT = sizeof depths / sizeof *depths };
    for (int i = 0; i < COUNT; i++) {
        points[i] = (FitPoint){.time = i, .depth = depths[i], .speed = NAN};
    }
    assert_int_equal(fit_loading(points, COUNT), 6); /* 3 mm counts both times */
    assert_true(points[3].time == 8 && points[5].depth == 0.005);
    for (int i = 0; i < ROWS; i++) {
        points[i] = (FitPoint){.time = 0.01 * i, .depth = 0.002 * i, .speed = NAN};
    }
    points[3].speed = 7;
    fit_speeds(points, ROWS);
    for (int i = 0; i < ROWS; i++) {
        assert_true(fabs(points[i].speed - (i == 3 ? 7 : 0.2)) < 1e-9);
    }
    points[0].speed = points[0].time = NAN;
    fit_speeds(points, 1);
    assert_true(points[0].speed == 0);
}

static void refused(void **state) {
    (void)state;
    FitDef def = plate("grass");
    FitResult result;
    MildError error = {0};
    press(&def, points, ROWS, 0.04, 0.01, NOISE_OF_ROW, 1);
    assert_int_equal(fit_run(&def, points, FIT_POINTS_MIN - 1, &result, &error),
                     MILD_ERROR_ARGUMENT);
    points[5].force = NAN;
    assert_int_equal(fit_run(&def, points, ROWS, &result, &error), MILD_ERROR_RANGE);
    assert_non_null(strstr(error.text, "row 6"));
    def.material.alpha = -1;
    assert_int_equal(fit_run(&def, points, ROWS, &result, &error), MILD_ERROR_RANGE);
    def = plate("grass");
    def.elements = 0;
    assert_int_equal(fit_run(&def, points, 5, &result, &error), MILD_ERROR_ARGUMENT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(recovery),    cmocka_unit_test(exact), cmocka_unit_test(coverage),
        cmocka_unit_test(inseparable), cmocka_unit_test(drag),  cmocka_unit_test(loading),
        cmocka_unit_test(refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
