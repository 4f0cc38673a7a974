/* MILD_SOLVER_EXPLICIT, the paper's Algorithm 1 to the letter, against its equations. */
#include "ground_kit.h"

static MildSole *plate;

static int open_plate(void **state) {
    (void)state;
    plate = kit_plate(5, 3);
    return 0;
}

static int close_plate(void **state) {
    (void)state;
    mild_sole_destroy(plate);
    return 0;
}

/* A level plate of 15 elements at a depth, on sand. */
static void open_kit(Kit *kit, double depth, double dt) {
    const MildMaterial sand = mild_material_default();
    kit_open(kit, 1, plate, plate, &sand, dt);
    kit->mass[0] = 8.0;
    kit->inertia[0] = 0.05;
    kit->input.solver = MILD_SOLVER_EXPLICIT;
    kit->input.position[0][2] = -depth - mild_sole_z(plate);
    kit_inverse_inertia(kit);
}

/* The free motion of a step under a force [N]. */
static void push(Kit *kit, double x, double y, double z) {
    const double force[1][3] = {{x, y, z}};
    kit_free(kit, force);
}

/* Eqs 1 to 5 of one element, at the depth u and the speed w. */
static double printed_force(const MildMaterial *m, double pitch, double u, double w) {
    const double s = pitch * pitch, R = sqrt(s / 3.14159265358979323846);
    const double kappa = m->sigma_cone * s / cos(m->alpha);
    const double end = R * tan(m->alpha) / m->nu, t = fmin(u / end, 1.0);
    const double recruited = end * (t - t * t + t * t * t / 3.0);
    const double mass_rate = m->c_g * m->phi * m->rho * m->nu * s;
    const double drag = m->c_d * mass_rate * (1.0 - t) * (1.0 - t) * w * w;
    return (m->k_pen - kappa) * recruited + kappa * u + drag;
}

/* The force of the state before the step, on the way up too and in an imprint, whatever the step
 * does. */
TEST(normals_are_printed) {
    const double speeds[] = {0.0, 0.3, -0.3};
    for (int i = 0; i < 9; i++) {
        const double depth = 0.004 + 0.01 * (i / 3), w = speeds[i % 3];
        Kit kit;
        open_kit(&kit, depth + 0.02, 5e-3);
        push(&kit, 0, 0, -500);
        kit_solve(&kit);
        kit_advance(&kit); /* it has been deeper */
        kit.input.position[0][2] = -depth - mild_sole_z(plate);
        memset(kit.input.velocity[0], 0, sizeof kit.input.velocity[0]);
        kit.input.velocity[0][2] = -w;
        push(&kit, 0, 0, -2000);
        kit_solve(&kit);
        const MildElements e = mild_scratch_elements(kit.scratch, 0);
        const double wanted =
            printed_force(&kit.terrain.materials[0], mild_sole_pitch(plate), depth, w);
        for (int k = 0; k < mild_sole_elements(plate); k++) {
            assert_true(fabs(e.normal[k] - wanted) < 1e-9 * wanted);
        }
        assert_true(kit.result.converged);
        kit_close(&kit);
    }
}

/* [m/s] Speed of an element along the ground after the step. */
static void slid(const Kit *kit, int k, double v[2]) {
    const MildElements e = mild_scratch_elements(kit->scratch, 0);
    const double *V = kit->result.velocity;
    const double p[3] = {e.point_x[k], e.point_y[k], e.point_z[k]};
    const double *at = kit->input.position[0];
    v[0] = V[0] + V[4] * (p[2] - at[2]) - V[5] * (p[1] - at[1]);
    v[1] = V[1] + V[5] * (p[0] - at[0]) - V[3] * (p[2] - at[2]);
}

/* Eq 13 at its fixed point: an element is at rest, or at its bound against its motion. */
TEST(friction_is_a_cone) {
    int stuck = 0, sliding = 0;
    for (int i = 0; i < 12; i++) {
        Kit kit;
        open_kit(&kit, 0.01, 5e-3);
        kit.terrain.materials[0].k_drift = kit.terrain.materials[0].b_drift = 0.0;
        kit.input.tolerance = 1e-13;
        kit.input.max_iterations = 20000;
        push(&kit, 6.0 * i, -2.5 * i, 0);
        kit_solve(&kit);
        assert_true(kit.result.converged);
        const MildElements e = mild_scratch_elements(kit.scratch, 0);
        for (int k = 0; k < mild_sole_elements(plate); k++) {
            double v[2];
            slid(&kit, k, v);
            const double bound = kit.terrain.materials[0].mu * e.normal[k];
            const double size = hypot(e.tangent_x[k], e.tangent_y[k]), speed = hypot(v[0], v[1]);
            assert_true(size <= bound * (1 + 1e-9));
            if (size < bound * (1 - 1e-6)) {
                assert_true(speed < 1e-6);
                stuck++;
            } else if (speed > 1e-4) {
                const double along = (e.tangent_x[k] * v[0] + e.tangent_y[k] * v[1]) / speed;
                assert_true(fabs(along + size) < 1e-4 * size);
                sliding++;
            }
        }
        kit_close(&kit);
    }
    print_message("%d elements stuck, %d slid\n", stuck, sliding);
    assert_true(stuck > 30 && sliding > 30);
}

/* Eq 14 against the velocity before the step: without friction it is all that is left. */
TEST(drift_is_printed) {
    Kit kit;
    open_kit(&kit, 0.02, 1e-3);
    MildMaterial *m = &kit.terrain.materials[0];
    m->mu = 0.0;
    m->k_drift = 4000.0;
    m->b_drift = 7.0;
    double path = 0.0;
    for (int step = 0; step < 20; step++) {
        kit.input.velocity[0][0] = 0.3;
        kit.input.velocity[0][1] = -0.4;
        kit.input.velocity[0][2] = 0.0;
        push(&kit, 0, 0, 0);
        kit.input.free_velocity[2] = 0.0;
        kit_solve(&kit);
        const MildElements e = mild_scratch_elements(kit.scratch, 0);
        const double size = 4000.0 * path * 0.02 + 7.0 * 0.5;
        assert_true(fabs(e.tangent_x[7] + 0.6 * size) < 1e-6 * size);
        assert_true(fabs(e.tangent_y[7] - 0.8 * size) < 1e-6 * size);
        double v[2];
        slid(&kit, 7, v);
        path += 1e-3 * hypot(v[0], v[1]);
        mild_ground_advance(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result);
    }
    kit_close(&kit);
}

TEST_MAIN(open_plate, close_plate)
