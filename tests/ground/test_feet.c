/* One to four feet: bodies that are not coupled, solved together or each for itself, move alike. */
#include "ground_kit.h"

enum { STEPS = 150 };

/* The second foot lands first, then the last: another lies in the air between and before them. */
static const double height[MILD_FEET_MAX] = {0.004, 0.0, 0.006, 0.002}; /* [m] at the start */

static void set_motion(Kit *kit, int f, int body) {
    uint64_t random = 40 + (uint64_t)body;
    kit->mass[f] = kit_uniform(&random, 5.0, 30.0);
    kit->inertia[f] = kit_uniform(&random, 0.1, 0.6);
    kit->center[f][2] = kit_uniform(&random, 0.0, 0.1);
    kit->input.position[f][0] = 0.4 * body;
    kit->input.position[f][1] = body % 2 ? -0.1 : 0.1;
    kit->input.position[f][2] = -KIT_SOLE_Z + height[body];
    for (int k = 0; k < 3; k++) {
        kit->input.velocity[f][k] = kit_uniform(&random, -0.3, 0.3);
        kit->input.velocity[f][3 + k] = kit_uniform(&random, -1.0, 1.0);
    }
    kit->input.velocity[f][2] = -0.3;
    kit->input.tolerance = 1e-13;
    kit->input.max_iterations = 5000;
}

/* Largest difference of the twists over all steps, in m/s and rad/s. */
static double together_and_alone(int feet, MildSolver solver, const MildMaterial *m) {
    MildSole *sole[2] = {kit_sole(0, 77), kit_sole(1, 77)};
    Kit all, one[MILD_FEET_MAX];
    double worst = 0.0;
    int touched = 0;
    kit_open(&all, feet, sole[0], sole[1], m, 1e-3);
    for (int f = 0; f < feet; f++) {
        kit_open(&one[f], 1, sole[f % 2], NULL, m, 1e-3);
        set_motion(&all, f, f);
        set_motion(&one[f], 0, f);
        one[f].input.solver = solver;
    }
    all.input.solver = solver;
    for (int s = 0; s < STEPS; s++) {
        kit_step(&all, NULL);
        assert_true(all.result.converged);
        for (int f = 0; f < feet; f++) {
            kit_step(&one[f], NULL);
            for (int k = 0; k < 6; k++) {
                worst =
                    fmax(worst, fabs(all.result.velocity[6 * f + k] - one[f].result.velocity[k]));
            }
            assert_int_equal(all.result.foot[f].contacts, one[f].result.foot[0].contacts);
            assert_true(fabs(all.result.foot[f].force[2] - one[f].result.foot[0].force[2]) <
                        1e-4 * (1.0 + fabs(one[f].result.foot[0].force[2])));
            touched |= (all.result.foot[f].contacts > 0) << f;
        }
    }
    assert_int_equal(touched, (1 << feet) - 1); /* every foot came down */
    kit_close(&all);
    for (int f = 0; f < feet; f++) {
        kit_close(&one[f]);
    }
    mild_sole_destroy(sole[0]);
    mild_sole_destroy(sole[1]);
    return worst;
}

static void test_together_as_alone(void **state) {
    (void)state;
    static const char *const names[] = {"newton", "sweeps"};
    static const MildSolver solvers[] = {MILD_SOLVER_NEWTON, MILD_SOLVER_GAUSS_SEIDEL};
    MildMaterial sand = mild_material_default();
    for (int feet = 1; feet <= MILD_FEET_MAX; feet++) {
        for (int k = 0; k < 2; k++) {
            double worst = together_and_alone(feet, solvers[k], &sand);
            print_message("%d feet, %s: together and alone differ by %.1e\n", feet, names[k],
                          worst);
            assert_true(worst < 1e-9);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_together_as_alone)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
