/* The press against the closed law of its elements, and what each kind of ground gives back. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "app/press.h"

static PressResult result;

static void press(const char *ground, double speed, double tilt) {
    MildError error = {0};
    PressDef def = {.depth = 0.03, .speed = speed, .tilt = tilt};
    assert_true(mild_material_preset(ground, &def.material));
    MildSole *plate = press_plate_create(0.2, 0.1, &error);
    assert_non_null(plate);
    assert_int_equal(press_run(&def, plate, &result, &error), MILD_OK);
    mild_sole_destroy(plate);
}

/* Slowly, drag and inertia vanish: the force is the number of elements times the quasistatic law. */
static void test_law(void **state) {
    (void)state;
    double worst = 0;
    for (int p = 0; p < mild_material_preset_count(); p++) {
        MildMaterial material;
        mild_material_preset(mild_material_preset_name(p), &material);
        press(mild_material_preset_name(p), 1e-4, 0);
        for (int i = 1; i <= PRESS_STEPS; i++) {
            double law = result.elements * mild_element_law(&material, 0.0195, result.rows[i].depth).force;
            double scale = result.elements * mild_element_law(&material, 0.0195, 0.03).force;
            worst = fmax(worst, fabs(result.rows[i].force - law) / scale);
        }
    }
    printf("worst difference from the law: %.2g of the peak\n", worst);
    assert_true(worst < 5e-3); /* a row is one implicit step of 0.03 mm */
}

static void test_energy(void **state) {
    (void)state;
    press("foam45", 1e-3, 0);
    printf("foam45 gives back %.4f of %.4f J\n", result.work_out, result.work_in);
    assert_true(result.work_out <= result.work_in * (1 + 1e-3) && result.work_out > 0.5 * result.work_in);
    assert_true(result.print_depth < 1e-3);
    press("sand_loose", 1e-3, 0);
    printf("sand_loose gives back %.4f of %.4f J\n", result.work_out, result.work_in);
    assert_true(result.work_out < 0.01 * result.work_in);
    assert_true(result.print_depth > 0.029);
}

/* A level plate has no moment and its zero moment point in the middle; the front edge down moves both forward. */
static void test_moments(void **state) {
    (void)state;
    press("sand_loose", 1e-3, 0);
    const PressRow *level = &result.rows[PRESS_STEPS];
    double lever = fabs(level->moment_x) + fabs(level->moment_y);
    printf("level: %.2g N m at %.1f N\n", lever, level->force);
    assert_true(lever < 1e-3 * level->force);
    assert_true(fabs(level->zmp_x) < 1e-3 && fabs(level->zmp_y) < 1e-3);
    press("sand_loose", 1e-3, 0.1);
    const PressRow *tilted = &result.rows[PRESS_STEPS];
    printf("tilted: zmp %.4f m, moment %.3f N m\n", tilted->zmp_x, tilted->moment_y);
    assert_true(result.rows[0].depth < 0 && result.rows[1].force >= 0);
    assert_true(tilted->zmp_x > 0.002 && tilted->moment_y < 0);
    assert_true(fabs(tilted->zmp_y) < 1e-3);
}

static void test_bad_material(void **state) {
    (void)state;
    MildError error = {0};
    PressDef def = {.material = mild_material_default(), .depth = 0.03, .speed = 0.01};
    def.material.k_pen = NAN;
    MildSole *plate = press_plate_create(0.1, 0.1, &error);
    assert_int_equal(press_run(&def, plate, &result, &error), MILD_ERROR_RANGE);
    mild_sole_destroy(plate);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_law),
        cmocka_unit_test(test_energy),
        cmocka_unit_test(test_moments),
        cmocka_unit_test(test_bad_material),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
