/* The artificial athlete against a mass on a linear spring, solved in time, and on concrete. */
#include "identify/athlete.h"
#include "kit.h"

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
    assert_int_equal(athlete_drop(&material, &athlete, &error), MILD_ERROR_RANGE);
    assert_error(&error, MILD_ERROR_RANGE, "ground.k_pen nan 10000000 [N/m] penetration");
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
