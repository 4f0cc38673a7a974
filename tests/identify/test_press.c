/* The press against the closed law of its elements, and what each kind of ground gives back. */
#include "identify/press.h"
#include "materials.h"

static PressResult result;

static PressDef definition(const char *ground) {
    PressDef def = {.turns = 1, .turn = {0.03}, .speed = 1e-3};
    def.material = kit_preset(ground);
    return def;
}

/* A plate of 0.2 x 0.1 m: 55 elements. */
static void press(const PressDef *def) {
    MildError error = {0};
    MildSole *plate = press_plate_create(0.2, 0.1, &error);
    assert_non_null(plate);
    press_result_close(&result);
    expect_good(press_run(def, plate, &result, &error) == MILD_OK, &error);
    mild_sole_destroy(plate);
}

static const PressRow *turn_of(int way) {
    const PressRow *last = result.rows;
    for (int i = 0; i < result.count; i++) {
        if (result.rows[i].way == way) {
            last = &result.rows[i];
        }
    }
    return last;
}

/* F_g + c_d m_a' w^2 of all elements: at constant speed the added mass does not accelerate. */
static double law(const MildMaterial *material, double depth, double speed) {
    MildElementLaw element = mild_element_law(material, 0.0195, depth);
    return result.elements *
           (element.force + material->c_d * element.added_mass_per_depth * speed * speed);
}

/* Force and depth of a row belong together, at any speed. */
TEST(test_law) {
    static const double speeds[] = {1e-4, 1e-2, 1};
    for (int n = 0; n < 3 * mild_material_preset_count(); n++) {
        PressDef def = definition(mild_material_preset_name(n / 3));
        def.speed = speeds[n % 3];
        press(&def);
        assert_true(result.rows[1000].depth == 0.03);
        for (int i = 2; i <= 1000; i++) {
            expect_near(mild_material_preset_name(n / 3), result.rows[i].force,
                        law(&def.material, result.rows[i].depth, def.speed),
                        1e-5 * law(&def.material, 0.03, 0));
        }
    }
}

TEST(test_energy) {
    PressDef def = definition("foam45");
    press(&def);
    assert_true(result.work_out <= result.work_in * (1 + 1e-3) &&
                result.work_out > 0.5 * result.work_in);
    assert_true(result.print_depth < 1e-3);
    def = definition("sand_loose");
    press(&def);
    assert_true(result.work_out < 0.01 * result.work_in);
    assert_true(result.print_depth > 0.029);
}

/* A level plate has no moment and its zero moment point in the middle; the front edge down moves
 * both forward. */
TEST(test_moments) {
    PressDef def = definition("sand_loose");
    press(&def);
    const PressRow *level = turn_of(0);
    double lever = fabs(level->moment_x) + fabs(level->moment_y);
    assert_true(lever < 1e-3 * level->force);
    assert_true(fabs(level->zmp_x) < 1e-3 && fabs(level->zmp_y) < 1e-3);
    def.tilt = 0.1;
    press(&def);
    const PressRow *tilted = turn_of(0);
    assert_true(result.rows[0].depth < 0 && result.rows[1].force >= 0);
    assert_true(tilted->zmp_x > 0.002 && tilted->moment_y < 0);
    assert_true(fabs(tilted->zmp_y) < 1e-3);
}

/* Down again past the old turn, the force goes on along the law. */
TEST(test_reload) {
    for (int p = 0; p < mild_material_preset_count(); p++) {
        PressDef def = definition(mild_material_preset_name(p));
        def.turns = 3;
        def.turn[0] = 0.01;
        def.turn[1] = 0.002;
        def.turn[2] = 0.02;
        press(&def);
        assert_true(turn_of(0)->depth == 0.01 && turn_of(1)->depth == 0.002 &&
                    turn_of(2)->depth == 0.02);
        assert_int_equal(result.ways, 4); /* and out */
        double before = law(&def.material, 0.01, 0), after = law(&def.material, 0.02, 0);
        expect_near("before", turn_of(0)->force / before, 1, 1e-4);
        expect_near("loaded deeper", turn_of(2)->force / after, 1, 1e-4);
    }
}

/* Cycles between two depths give back what the line holds; between two forces they turn at those
 * forces. */
TEST(test_cycles) {
    PressDef def = definition("foam45");
    def.cycles = 4;
    def.turns = 2;
    def.turn[1] = 0.01;
    press(&def);
    assert_int_equal(turn_of(8)->way, 8); /* four times down and back, then out */
    for (int cycle = 1; cycle < 4; cycle++) {
        assert_true(fabs(turn_of(2 * cycle)->force / turn_of(0)->force - 1) < 1e-9);
        assert_true(turn_of(2 * cycle + 1)->depth == 0.01);
    }
    for (int p = 0; p < mild_material_preset_count(); p++) {
        def = definition(mild_material_preset_name(p));
        def.by_force = 1;
        def.turns = 2;
        def.turn[0] = 300;
        def.turn[1] = 50;
        def.cycles = 3;
        press(&def);
        for (int way = 0; way < 6; way++) {
            expect_entry("turn", way, turn_of(way)->force / (way % 2 ? 50 : 300), 1, 1e-9);
        }
    }
}

/* Sideways at constant depth u over the way d: friction mu F, drift k_D d u and damping b_D v of
 * every element (eq 14). */
TEST(test_drag) {
    for (int p = 0; p < mild_material_preset_count(); p++) {
        PressDef def = definition(mild_material_preset_name(p));
        def.drag = 0.05;
        def.drag_speed = 0.1;
        press(&def);
        const PressRow *end = turn_of(1);
        const MildMaterial *m = &def.material;
        double before = 0.05; /* the row is of the step that begins there */
        double expected = m->mu * law(m, 0.03, 0) +
                          result.elements * (m->k_drift * before * 0.03 + m->b_drift * 0.1);
        expect_near("closed form", -end->force_x / expected, 1, 1e-4);
        assert_true(fabs(end->x - 0.05) < 1e-9 && fabs(end->force_y) < 1e-9);
        assert_true(result.work_drag > 0);
    }
}

/* What falls comes to rest: the ground takes the weight times the whole height; a tilted plate
 * lands flat. */
TEST(test_drop) {
    PressDef def = {.mass = 5, .height = 0.1, .seconds = 1};
    mild_material_preset("sand_dense", &def.material);
    press(&def);
    const PressRow *end = &result.rows[result.count - 1];
    double fallen = def.mass * 9.81 * (def.height + end->depth),
           taken = result.work_in - result.work_out;
    printf("dropped: stop %.3f mm, work %.4f J of %.4f J\n", 1e3 * result.stop_depth, taken,
           fallen);
    assert_true(fabs(taken / fallen - 1) < 0.01);
    assert_true(fabs(end->force / (def.mass * 9.81) - 1) < 1e-3 && result.rest_speed < 1e-4);
    def.tilt = 0.1;
    press(&def);
    end = &result.rows[result.count - 1];
    printf("tilted 0.1 rad it comes to rest at %.4f rad\n", end->tilt);
    assert_true(fabs(end->tilt) < 0.03 && result.rest_speed < 1e-3);
}

/* (k_c/b + k_phi) u^n of the area, b the plate's shorter side: through the ground's step. */
TEST(test_width) {
    static const double sides[][2] = {{0.3, 0.2}, {0.2, 0.1}, {0.06, 0.15}};
    for (int i = 0; i < 3; i++) {
        MildError error = {0};
        PressDef def = definition("clay");
        const double b = fmin(sides[i][0], sides[i][1]);
        def.material.k_c = i == 2 ? -30e3 : def.material.k_c;
        MildSole *plate = press_plate_create(sides[i][0], sides[i][1], &error);
        press_result_close(&result);
        assert_int_equal(press_run(&def, plate, &result, &error), MILD_OK);
        const PressRow *end = turn_of(0);
        const double p = (def.material.k_c / b + def.material.k_phi) * pow(end->depth, 0.5);
        expect_entry("bekker", i, end->force / (p * result.area), 1, 1e-3);
        mild_sole_destroy(plate);
    }
    press_result_close(&result);
}

/* A plate too small for a k_c below 0, a force that nothing gives, a material of no numbers. */
TEST(test_refused) {
    MildError error = {0};
    PressDef def = definition("clay");
    MildSole *plate = press_plate_create(0.1, 0.04, &error);
    def.material.k_c = -0.041 * def.material.k_phi;
    assert_refused(press_run(&def, plate, &result, &error), MILD_ERROR_RANGE, &error,
                   "ground.k_c 0.04 0.041 ground.plate_width");
    def.material.plate_width = 0.1;
    assert_int_equal(press_run(&def, plate, &result, &error), MILD_OK);
    press_result_close(&result);
    def = definition("foam25");
    def.by_force = 1;
    def.turn[0] = 1e6;
    assert_refused(press_run(&def, plate, &result, &error), MILD_ERROR_RANGE, &error, "--force");
    def.material.k_pen = NAN;
    assert_refused(press_run(&def, plate, &result, &error), MILD_ERROR_RANGE, &error,
                   "ground.k_pen nan");
    mild_sole_destroy(plate);
    press_result_close(&result);
}

TEST_MAIN(NULL, NULL)
