/* Any number of feet: bodies that are not coupled, solved together or each for itself, move alike;
 * and feet whose rows are left out because they are far from the ground change nothing. */
#include "ground_kit.h"

enum { STEPS = 150, ROWS = 6 * MILD_FEET_MAX };

/* [m] At the start. Of four the second foot lands first, then the last: another lies in the air
 * between and before them. */
static double height_of(int body) {
    static const double height[4] = {0.004, 0.0, 0.006, 0.002};
    return height[body % 4] + 0.0003 * (body / 4);
}

static void set_motion(Kit *kit, int f, int body) {
    uint64_t random = 40 + (uint64_t)body;
    kit->mass[f] = kit_uniform(&random, 5.0, 30.0);
    kit->inertia[f] = kit_uniform(&random, 0.1, 0.6);
    kit->center[f][2] = kit_uniform(&random, 0.0, 0.1);
    kit->input.position[f][0] = 0.4 * body;
    kit->input.position[f][1] = body % 2 ? -0.1 : 0.1;
    kit->input.position[f][2] = -KIT_SOLE_Z + height_of(body);
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
    static Kit all, one[MILD_FEET_MAX];
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

TEST(test_together_as_alone) {
    static const char *const names[] = {"newton", "sweeps"};
    static const MildSolver solvers[] = {MILD_SOLVER_NEWTON, MILD_SOLVER_GAUSS_SEIDEL};
    MildMaterial sand = mild_material_default();
    static const int counts[] = {1, 2, 3, 4, 9, MILD_FEET_MAX};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        /* of repetitions the smallest, and the most feet once */
        const int last = !kit_finest() || counts[i] < 4 ? 2 : counts[i] == MILD_FEET_MAX;
        for (int k = 0; k < last; k++) {
            expect_below(names[k], together_and_alone(counts[i], solvers[k], &sand), 1e-9);
        }
    }
}

/* A body with many feet: all coupled through its mass, A = J M^-1 J^T. */
static void couple(Kit *kit) {
    const int n = 6 * kit->feet;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            kit->A[i * n + j] = 0.3 * kit->A[i * n + j] + (i % 6 == j % 6 ? 0.01 : 0.0);
        }
    }
}

/* Leaves out the rows and columns of A of the feet that are not in `rows`. */
static void keep_rows(Kit *kit, uint32_t rows) {
    static double kept[ROWS * ROWS];
    int n = 0;
    for (int i = 0; i < 6 * kit->feet; i++) {
        for (int j = 0; rows >> (i / 6) & 1 && j < 6 * kit->feet; j++) {
            if (rows >> (j / 6) & 1) {
                kept[n++] = kit->A[i * 6 * kit->feet + j];
            }
        }
    }
    kit->input.rows = rows;
    memcpy(kit->A, kept, (size_t)n * sizeof *kept);
}

static int bits(uint32_t word) {
    return word ? (int)(word & 1) + bits(word >> 1) : 0;
}

/* Feet at heights up to 10 cm come down one after the other, on level ground or a map. In one kit A
 * has all rows, in the other those that mild_ground_near names. */
static void near_as_all(MildSolver solver, const MildMap *map) {
    MildSole *sole[2] = {kit_sole(0, 77), kit_sole(1, 77)};
    MildMaterial sand = mild_material_default();
    static Kit all, some;
    Kit *const kits[] = {&all, &some};
    int least = MILD_FEET_MAX, most = 0;
    for (int k = 0; k < 2; k++) {
        kit_open(kits[k], MILD_FEET_MAX, sole[0], sole[1], &sand, 1e-3);
        for (int f = 0; f < MILD_FEET_MAX; f++) {
            set_motion(kits[k], f, f);
            kits[k]->input.position[f][2] += 0.006 * f;
            kits[k]->input.tolerance = 1e-11;
        }
        kits[k]->input.solver = solver;
        kits[k]->terrain.map = map;
    }
    for (int s = 0; s < 2 * STEPS; s++) {
        for (int k = 0; k < 2; k++) {
            kit_inverse_inertia(kits[k]);
            couple(kits[k]);
            kit_free(kits[k], NULL);
        }
        const uint32_t near = mild_ground_near(&some.terrain, &some.input, some.scratch);
        least = bits(near) < least ? bits(near) : least;
        most = bits(near) > most ? bits(near) : most;
        some.input.rows = 0;
        assert_int_equal(mild_contact_check(some.ground, &some.terrain, &some.input, NULL),
                         MILD_OK);
        keep_rows(&some, near);
        if (near) {
            assert_int_equal(mild_contact_check(some.ground, &some.terrain, &some.input, NULL),
                             MILD_OK);
        }
        kit_solve(&all);
        kit_solve(&some);
        assert_true(all.result.converged && some.result.converged);
        for (int f = 0; f < MILD_FEET_MAX; f++) {
            assert_memory_equal(&all.result.foot[f], &some.result.foot[f],
                                sizeof all.result.foot[f]);
            if (near >> f & 1) {
                assert_memory_equal(all.result.velocity + 6 * f, some.result.velocity + 6 * f,
                                    6 * sizeof(double));
            } else { /* the coupling moves it, which `some` does not know */
                memcpy(some.result.velocity + 6 * f, all.result.velocity + 6 * f,
                       6 * sizeof(double));
            }
        }
        kit_advance(&all);
        kit_advance(&some);
        assert_memory_equal(all.ground, some.ground, all.bytes);
    }
    assert_true(least <= 3 && most == MILD_FEET_MAX);
    kit_close(&all);
    kit_close(&some);
    mild_sole_destroy(sole[0]);
    mild_sole_destroy(sole[1]);
}

TEST(test_near_as_all) {
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_ROUGH;
    def.size = 20.0;
    MildMap *rough = mild_map_create(&def, NULL);
    if (!kit_finest()) {
        near_as_all(MILD_SOLVER_NEWTON, NULL);
        near_as_all(MILD_SOLVER_GAUSS_SEIDEL, NULL);
    }
    near_as_all(MILD_SOLVER_NEWTON, rough);
    mild_map_destroy(rough);
}

/* Rough ground, then level ground, on which nothing may be left of the slopes: the same steps with
 * and without the question which feet are near. */
TEST(test_near_forgets_slopes) {
    MildSole *sole[2] = {kit_sole(0, 77), kit_sole(1, 77)};
    MildMaterial sand = mild_material_default();
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_ROUGH;
    def.size = 20.0;
    MildMap *rough = mild_map_create(&def, NULL);
    static Kit kit[2];
    for (int k = 0; k < 2; k++) {
        kit_open(&kit[k], 2, sole[0], sole[1], &sand, 1e-3);
        set_motion(&kit[k], 0, 0);
        set_motion(&kit[k], 1, 1);
    }
    for (int s = 0; s < STEPS; s++) {
        for (int k = 0; k < 2; k++) {
            kit[k].terrain.map = s < STEPS / 2 ? rough : NULL;
            kit_inverse_inertia(&kit[k]);
            kit_free(&kit[k], NULL);
            if (k == 1) {
                mild_ground_near(&kit[k].terrain, &kit[k].input, kit[k].scratch);
            }
            kit_solve(&kit[k]);
            kit_advance(&kit[k]);
        }
        assert_memory_equal(&kit[0].result, &kit[1].result, sizeof kit[0].result);
    }
    assert_true(kit[0].result.foot[0].contacts > 0);
    kit_close(&kit[0]);
    kit_close(&kit[1]);
    mild_map_destroy(rough);
    mild_sole_destroy(sole[0]);
    mild_sole_destroy(sole[1]);
}

/* No rows at all, rows of feet that do not exist, and no matrix. */
TEST(test_refused_rows) {
    MildSole *sole[2] = {kit_sole(0, 77), kit_sole(1, 77)};
    MildMaterial sand = mild_material_default();
    MildError error;
    static Kit kit;
    kit_open(&kit, 2, sole[0], sole[1], &sand, 1e-3);
    kit_inverse_inertia(&kit);
    kit_free(&kit, NULL);
    kit.input.rows = 4;
    assert_refused(mild_contact_check(kit.ground, &kit.terrain, &kit.input, &error),
                   MILD_ERROR_RANGE, &error, "input.rows 0x4 2");
    kit.input.rows = 0;
    kit.input.inverse_inertia = NULL;
    assert_refused(mild_contact_check(kit.ground, &kit.terrain, &kit.input, &error),
                   MILD_ERROR_ARGUMENT, &error, "input.inverse_inertia NULL");
    mild_ground_solve(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result);
    assert_false(kit.result.converged);
    assert_memory_equal(kit.result.velocity, kit.input.free_velocity, 12 * sizeof(double));
    /* and nothing of the step before is done again */
    kit.input.inverse_inertia = kit.A;
    kit.input.position[0][2] = kit.input.position[1][2] = -0.01;
    kit.input.velocity[0][2] = kit.input.free_velocity[2] = -0.1;
    kit_solve(&kit);
    mild_ground_advance(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result);
    void *before = aligned_alloc(64, kit.bytes);
    memcpy(before, kit.ground, kit.bytes);
    assert_true(mild_ground_depth_max(kit.ground, 0)[0] > 0);
    kit.input.inverse_inertia = NULL;
    kit_solve(&kit);
    mild_ground_advance(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result);
    assert_memory_equal(kit.ground, before, kit.bytes);
    free(before);
    kit_close(&kit);
    mild_sole_destroy(sole[0]);
    mild_sole_destroy(sole[1]);
}

TEST_MAIN(NULL, NULL)
