/* The press against the closed law of its elements, and what each kind of ground gives back. */
#include "identify/press.h"

#include "identify/athlete.h"
#include "kit.h"
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

/* The artificial athlete against a mass on a linear spring, solved in time, and on concrete. */

#define AREA (0.25 * 3.14159265358979 * ATHLETE_FOOT * ATHLETE_FOOT)
#define CELL (0.0195 * 0.0195) /* [m^2] to which k_pen belongs */

/* Ground of a stiffness [N/m^3] that gives all energy back. */
static MildMaterial spring(double stiffness) {
    MildMaterial m = mild_material_default();
    m.model = MILD_MODEL_HUNT_CROSSLEY;
    m.k_pen = stiffness * CELL;
    m.exponent = 1.0;
    m.dissipation = 0.0;
    return m;
}

static Athlete drop(const MildMaterial *material) {
    MildError error = {0};
    Athlete athlete = {0};
    expect_good(athlete_drop(material, &athlete, &error) == MILD_OK, &error);
    return athlete;
}

/* [N] m y'' = m g - c y from y = 0, y' = v: y(t) = y0 (1 - cos wt) + v/w sin wt, y0 = m g/c. The
 * turn is at tan wt = -v/(w y0), and the force there is c y. */
static double half_period(const AthleteDevice *device, double ground) {
    const double c = 1.0 / (1.0 / device->spring + 1.0 / ground);
    const double rate = sqrt(c / ATHLETE_MASS);
    const double rest = ATHLETE_MASS * ATHLETE_GRAVITY / c;
    const double speed = sqrt(2.0 * ATHLETE_GRAVITY * device->fall);
    const double phase = atan2(speed / rate, -rest);
    return c * (rest * (1.0 - cos(phase)) + speed / rate * sin(phase));
}

TEST(test_spring) {
    for (double stiffness = 4e6; stiffness < 1e9; stiffness *= 3.0) {
        const MildMaterial material = spring(stiffness);
        const Athlete athlete = drop(&material);
        const double peak = half_period(&athlete_shock, stiffness * AREA);
        const double concrete = half_period(&athlete_shock, 1e18);
        expect_near("reduction", athlete.reduction, 1.0 - peak / concrete, 0.009);
        expect_near("returned", athlete.returned, 1.0, 0.009);
        expect_near("deformation", athlete.deformation * stiffness * AREA / 1500.0, 1.0, 0.009);
        expect_near("concrete", athlete.concrete, concrete, 1e-6 * concrete);
    }
}

/* FIFA and ASTM F3189 take 6760 N for concrete; EN 14808 and 14809 accept 6.60 kN +- 0.25 and have
 * about 1500 N. Ground as stiff as can be reduces nothing. */
TEST(test_concrete) {
    MildMaterial stiff = spring(0.0);
    stiff.k_pen = 1e7;
    const Athlete athlete = drop(&stiff);
    expect_near("concrete", athlete.concrete, 6760.0, 10.0);
    assert_true(fabs(athlete.reduction) < 0.015 && athlete.deformation < 2e-5);
}

/* A firm bed is left out, and a ground that takes energy returns less. */
TEST(test_kinds) {
    MildMaterial material = spring(4e6);
    const Athlete deep = drop(&material);
    material.bed_depth = 0.001;
    const Athlete shallow = drop(&material);
    assert_memory_equal(&deep, &shallow, sizeof deep);
    material.dissipation = 0.5;
    assert_true(drop(&material).returned < 0.5);
    material = mild_material_default();
    assert_true(drop(&material).returned < 0.01);
    material.k_pen = NAN;
    MildError error = {0};
    Athlete athlete;
    assert_refused(athlete_drop(&material, &athlete, &error), MILD_ERROR_RANGE, &error,
                   "ground.k_pen nan 10000000 [N/m] penetration");
}

/* Surfaces that are sold by these numbers, and the ranges in which they are (docs/model.md section
 * 10). */
TEST(test_published) {
    static const struct {
        const char *ground;
        double reduction[2];   /* [-] */
        double deformation[2]; /* [m] */
    } published[] = {
        {"rubber_tile", {0.25, 0.75}, {0.0, 0.005}},
        {"running_track", {0.35, 0.50}, {0.0006, 0.0025}},
        {"artificial_turf", {0.55, 0.70}, {0.004, 0.011}},
    };
    for (size_t i = 0; i < sizeof published / sizeof *published; i++) {
        const double *r = published[i].reduction, *d = published[i].deformation;
        MildMaterial material;
        assert_true(mild_material_preset(published[i].ground, &material));
        const Athlete athlete = drop(&material);
        expect_near(published[i].ground, athlete.reduction, (r[0] + r[1]) / 2, (r[1] - r[0]) / 2);
        expect_near(published[i].ground, athlete.deformation, (d[0] + d[1]) / 2, (d[1] - d[0]) / 2);
        expect_near(published[i].ground, athlete.returned, 0.6, 0.1); /* 0.63 of a track */
    }
}

TEST_MAIN(NULL, NULL)
