/* Resistive force theory: published values, symmetries, and the contact step against the
 * coefficients. */
#include "ground_kit.h"

#include "ground/law/begin.h"
#include "ground/law/plate.h"

#define PI 3.14159265358979323846

static void unit(double beta, double heading,
                 double *n) { /* normal of a plate that slopes by beta along heading */
    n[0] = sin(beta) * cos(heading);
    n[1] = sin(beta) * sin(heading);
    n[2] = -cos(beta);
}

static void moving(double gamma, double heading, double *v) {
    v[0] = cos(gamma) * cos(heading);
    v[1] = cos(gamma) * sin(heading);
    v[2] = -sin(gamma);
}

/* Numbers that follow from the printed coefficients at angles where few terms are left. */
TEST(test_published) {
    double alpha[2], space[3], n[3], v[3];
    mild_resist_plane(0.0, PI / 2.0, alpha);
    assert_true(fabs(alpha[1] - 1.000) < 1e-12 && fabs(alpha[0] - 0.007) < 1e-12);
    mild_resist_plane(0.0, 0.0, alpha);
    assert_true(fabs(alpha[1] - 0.375) < 1e-12 && fabs(alpha[0] - 0.129) < 1e-12);
    mild_resist_plane(PI / 2.0, 0.0, alpha); /* a vertical plate moving level */
    assert_true(fabs(alpha[1] - 0.037) < 1e-12 && fabs(alpha[0] - 0.377) < 1e-12);
    unit(0.0, 0.0, n);
    moving(PI / 2.0, 0.0, v);
    mild_resist_space(n, v, space);
    expect_near("level plate straight down", space[2], 1.0, 1e-4);
    expect_near("to the side", space[0], 0.0, 1e-6);
}

/* alpha_z is greatest for a level plate going straight down; a leading plate is resisted; the
 * ground never drives it. */
TEST(test_signs) {
    double greatest = 0.0, least_power = INFINITY, least_forward = INFINITY;
    for (int i = -90; i <= 90; i++) {
        for (int j = 0; j <= 90; j++) {
            double beta = i * PI / 180.0, gamma = j * PI / 180.0, alpha[2];
            mild_resist_plane(beta, gamma, alpha);
            greatest = fmax(greatest, alpha[1]);
            least_power = fmin(least_power, alpha[0] * cos(gamma) + alpha[1] * sin(gamma));
            if (i >= 0 && j < 90) {
                least_forward = fmin(least_forward, alpha[0]);
            }
        }
    }
    assert_true(greatest < 1.0 + 1e-12 && least_power > 0.0);
    assert_true(least_forward >
                -0.001); /* the printed C-11 = 0.007 breaks the fit's symmetry by as much */
    uint64_t random = 3;
    double most = -INFINITY, peak = 0.0;
    for (int draw = 0; draw < 200000; draw++) {
        double n[3], v[3], alpha[3];
        unit(acos(kit_uniform(&random, 0.0, 1.0)), kit_uniform(&random, -PI, PI), n);
        moving(asin(kit_uniform(&random, 0.0, 1.0)), kit_uniform(&random, -PI, PI), v);
        mild_resist_space(n, v, alpha);
        if (n[0] * v[0] + n[1] * v[1] + n[2] * v[2] > 0.0) {
            most = fmax(most, alpha[0] * v[0] + alpha[1] * v[1] + alpha[2] * v[2]);
        }
        peak = fmax(peak, alpha[2]);
    }
    expect_below("greatest power given in 3D", most, 0.0);
    expect_below("greatest alpha_z in 3D", peak, RESIST_PEAK);
}

/* Force on a plate of 5 x 3 elements tilted by beta about y, 20 mm deep in its middle, moved by
 * hand at 0.2 m/s. */
static void plate_force(int model, double beta, double gamma, double *force, double *product) {
    const double dt = 1e-4, speed = 0.2, depth = 0.02, zeta = 0.254;
    MildSole *sole = kit_plate(5, 3);
    MildMaterial mild = mild_material_default(), m;
    MildError error = {0};
    assert_int_equal(mild_model_match((MildModel)model, &mild, sole, 50.0, &m, &error), MILD_OK);
    m.zeta = zeta;
    Kit kit;
    kit_open(&kit, 1, sole, NULL, &m, dt);
    const double turn[3] = {0.0, -beta, 0.0}; /* front edge up: the sole looks forward */
    kit_rotate(kit.input.rotation[0], turn);
    kit.input.velocity[0][0] = kit.input.free_velocity[0] = speed * cos(gamma);
    kit.input.velocity[0][2] = kit.input.free_velocity[2] = -speed * sin(gamma);
    const double *R = kit.input.rotation[0];
    for (int s = 0; s < 20;
         s++) { /* deeper each time, so that all of it is virgin ground at the end */
        kit.input.position[0][2] =
            -R[8] * KIT_SOLE_Z - depth - (gamma > 0.0 ? s * dt * speed * sin(gamma) : 0.0);
        kit_solve(&kit);
        mild_ground_advance(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result);
    }
    MildElements elements = mild_scratch_elements(kit.scratch, 0);
    *product = 0.0; /* area times depth of the elements in the ground, in the middle of the step */
    for (int e = 0; e < 15; e++) {
        if (elements.depth[e] > 0.0) {
            *product += KIT_PITCH * KIT_PITCH * (elements.depth[e] + 0.5 * dt * speed * sin(gamma));
        }
    }
    *product *= zeta * 1e6;
    memcpy(force, kit.result.foot[0].force, 3 * sizeof(double));
    kit_close(&kit);
    mild_sole_destroy(sole);
}

TEST(test_contact_step) {
    static const double betas[4] = {0.0, 0.2, 0.4, -0.2},
                        gammas[5] = {0.0, 0.3, 0.8, 1.2, PI / 2.0};
    for (int model = MILD_MODEL_ECC_QUASI; model <= MILD_MODEL_ECC_QUASI_3D; model++) {
        for (int b = 0; b < 4; b++) {
            for (int g = 0; g < 5; g++) {
                double alpha[3], n[3], v[3], force[3], product;
                unit(betas[b], 0.0, n);
                moving(gammas[g], 0.0, v);
                if (model == MILD_MODEL_ECC_QUASI) {
                    mild_resist_plane(betas[b], gammas[g], alpha);
                    alpha[2] = alpha[1];
                } else {
                    mild_resist_space(n, v, alpha);
                    alpha[0] = -alpha[0];
                }
                plate_force(model, betas[b], gammas[g], force, &product);
                double back = cos(gammas[g]) > 1e-9 ? fmax(alpha[0], 0.0)
                                                    : 0.0; /* across the motion: left out */
                expect_near("up", force[2] / product, fmax(alpha[2], 0.0), 0.02);
                expect_near("back", -force[0] / product, back, 0.02);
            }
        }
    }
}

/* Vertical work [J] that the ground gives, at its most, to a plate led by hand from the air through
 * a few random depths of the first elastic travels and into the air again, while it slides or
 * stands. It is the impulse times the mean speed, so what a body's kinetic energy gains. */
static double landed(Kit *kit, uint64_t *random) {
    const double dt = kit->input.dt;
    double most = -INFINITY;
    for (int round = 0; round < 100; round++) {
        const int steps = 1 + (int)kit_uniform(random, 0.0, 5.0);
        double z = -5e-4, before = 0.0, work = 0.0;
        for (int s = 0; s <= steps + 1; s++) { /* the last two in the air */
            const double next = s < steps ? kit_uniform(random, -1e-4, 4e-4) : -5e-4;
            const double speed = (next - z) / dt;
            const int slides = kit_uniform(random, 0.0, 1.0) < 0.5;
            kit->input.position[0][2] = -KIT_SOLE_Z * kit->input.rotation[0][8] - z;
            kit->input.velocity[0][0] = kit->input.free_velocity[0] = slides ? 0.2 : 0.0;
            kit->input.velocity[0][2] = -before;
            kit->input.free_velocity[2] = -speed;
            kit_solve(kit);
            mild_ground_advance(kit->ground, &kit->terrain, &kit->input, kit->scratch,
                                &kit->result);
            work -= kit->result.foot[0].force[2] * dt * (before + speed) / 2;
            z = next;
            before = speed;
        }
        most = fmax(most, work);
    }
    return most;
}

TEST(test_landing) {
    MildSole *sole = kit_plate(5, 3);
    uint64_t random = 21;
    for (int model = MILD_MODEL_ECC_QUASI; model <= MILD_MODEL_ECC_QUASI_3D; model++) {
        double most = -INFINITY;
        for (int draw = 0; draw < 60; draw++) {
            MildMaterial mild = mild_material_default(), m;
            Kit kit;
            assert_int_equal(mild_model_match((MildModel)model, &mild, sole, 50.0, &m, NULL),
                             MILD_OK);
            kit_open(&kit, 1, sole, NULL, &m, draw % 2 ? 1e-3 : 5e-3);
            const double turn[3] = {0.0, kit_uniform(&random, -1e-3, 1e-3), 0.0};
            kit_rotate(kit.input.rotation[0], turn);
            most = fmax(most, landed(&kit, &random));
            kit_close(&kit);
        }
        expect_below("given to a plate that lands and lifts off [J]", most, 1e-12);
    }
    mild_sole_destroy(sole);
}

/* No element remembers 3 mm more than it has been deep and can go in a step: not where its face
 * trails, so that nothing but rounding stops it, nor on ground without strength. */
TEST(test_remembered_depth) {
    static const double zeta[] = {100, 0}; /* stiff and deep: there rounding is felt most */
    const double dt = 5e-3;
    MildSole *sole = kit_plate(5, 3);
    uint64_t random = 12;
    for (int model = MILD_MODEL_ECC_QUASI; model <= MILD_MODEL_ECC_QUASI_3D; model++) {
        double most = 0;
        for (int draw = 0; draw < kit_draws(2000); draw++) {
            MildMaterial mild = mild_material_default(), m;
            Kit kit;
            double deepest = 0, fastest = 0;
            assert_int_equal(mild_model_match((MildModel)model, &mild, sole, 50, &m, NULL),
                             MILD_OK);
            m.zeta *= zeta[draw % 8 == 0];
            m.bed_depth = 10;
            kit_open(&kit, 1, sole, NULL, &m, dt);
            kit_random_state(&kit, &random);
            kit.input.position[0][2] -= kit_uniform(&random, 0, 0.1);
            if (draw % 2) { /* lifted while it goes the way that its face does not */
                const double *R = kit.input.rotation[0];
                kit.input.velocity[0][0] = 20 * R[2];
                kit.input.velocity[0][1] = 20 * R[5];
                kit.input.velocity[0][2] = kit_uniform(&random, -0.3, 0);
            }
            for (int step = 0; step < 20; step++) {
                const double pull = 10 * kit.mass[0];
                const double force[1][3] = {
                    {kit_uniform(&random, -pull, pull), kit_uniform(&random, -pull, pull),
                     kit_uniform(&random, draw % 2 ? pull : -pull, 3 * pull)}};
                const double *v = kit.input.velocity[0];
                fastest = fmax(fastest, fabs(v[2]) + 0.15 * hypot(v[3], v[4]));
                kit_step(&kit, force);
                fastest = fmax(fastest, fabs(v[2]) + 0.15 * hypot(v[3], v[4]));
                const double *depth = mild_ground_depth_max(kit.ground, 0);
                /* of the lowest corner of the plate, 60 mm from its middle */
                const double *R = kit.input.rotation[0];
                const double low =
                    -kit.input.position[0][2] - R[8] * KIT_SOLE_Z + 0.06 * hypot(R[6], R[7]);
                deepest = fmax(deepest, low);
                for (int e = 0; e < mild_sole_elements(sole); e++) {
                    assert_true(isfinite(depth[e]));
                    most = fmax(most, depth[e] - deepest - dt * fastest);
                }
            }
            kit_close(&kit);
        }
        expect_below("remembered beyond where it has been [m]", most, 3e-3);
    }
    mild_sole_destroy(sole);
}

/* Ground without strength has no line to unload on: it is of no length, at the depth reached. */
TEST(test_no_strength) {
    const double dt = 5e-3, rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const Plate plate = plate_of(rotation);
    for (int bed = 0; bed < 2; bed++) {
        Element e = {.depth = 0.02, .law = {.bed_depth = bed ? 0.015 : 10, .bed_stiffness = 1e4}};
        const ElementMemory memory = {.depth_max = 0.021, .middle = 0.0195};
        element_begin(&e, &memory, LAW_LINE, dt, 1 / dt, 0.1);
        element_resist(&e, &memory, &plate, 1, LAW_LINE, dt, 1 / dt, 0, 0, 0, 0.1);
        assert_true(isfinite(e.zero_depth) && isfinite(e.unload_stiffness));
        assert_true(fabs(e.yield_depth - 0.021) < 1e-12);
        const double held = e.unload_stiffness * (e.yield_depth - e.zero_depth);
        assert_true(fabs(held - (bed ? 1e4 * 0.006 : 0)) < 1e-9);
    }
}

TEST_MAIN(NULL, NULL)
