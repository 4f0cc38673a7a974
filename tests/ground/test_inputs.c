/* Material, terrain and sole: what is refused, and that the message names the field. */
#include "ground_kit.h"

#include "draws.h"
#include "surface_kit.h"

TEST(test_material_refused) {
    for (int f = 0; f < mild_material_field_count; f++) {
        const MildField *field = &mild_material_fields[f];
        if (field->type != MILD_FIELD_DOUBLE) {
            continue;
        }
        const double bad[3] = {NAN, field->max * 1.01 + 1.0, INFINITY};
        for (int i = 0; i < 3; i++) {
            MildMaterial m = mild_material_default();
            MildError error = {0};
            memcpy((char *)&m + field->offset, &bad[i], sizeof bad[i]);
            assert_int_equal(mild_material_check(&m, &error), MILD_ERROR_RANGE);
            char name[64];
            snprintf(name, sizeof name, "ground.%s", field->name);
            assert_error(&error, MILD_ERROR_RANGE, name);
        }
    }
}

TEST(test_terrain) {
    MildMaterial m = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&m);
    MildError error = {0};
    terrain.materials[1] = m;
    terrain.material_count = 2;
    MildPatch strip = {1.0, 2.0, -INFINITY, INFINITY, 1};
    assert_int_equal(mild_terrain_add_patch(&terrain, &strip, &error), MILD_OK);
    assert_int_equal(mild_terrain_material_at(&terrain, 0.999, 5.0), 0);
    assert_int_equal(mild_terrain_material_at(&terrain, 1.0, 5.0), 1);
    assert_int_equal(mild_terrain_material_at(&terrain, 2.0, 5.0), 0);
    const struct {
        MildPatch patch;
        MildStatus status;
        const char *names;
    } bad[] = {{{3, 3, 0, 1, 1}, MILD_ERROR_RANGE, "patch.x_min 3 patch.x_max"},
               {{NAN, 4, 0, 1, 1}, MILD_ERROR_RANGE, "patch.x_min nan patch.x_max 4"},
               {{3, 4, 1, 0, 1}, MILD_ERROR_RANGE, "patch.y_min 1 patch.y_max 0"},
               {{3, 4, 0, NAN, 1}, MILD_ERROR_RANGE, "patch.y_min 0 patch.y_max nan"},
               {{3, 4, 0, 1, 2}, MILD_ERROR_RANGE, "patch.material 2"},
               {{3, 4, 0, 1, -1}, MILD_ERROR_RANGE, "patch.material -1"},
               {{1.5, 4, 0, 1, 1}, MILD_ERROR_ARGUMENT, "patch.x_min patch.y_max patch 0"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_refused(mild_terrain_add_patch(&terrain, &bad[i].patch, &error), bad[i].status,
                       &error, bad[i].names);
        assert_int_equal(terrain.patch_count, 1);
    }
    for (int i = 1; i < MILD_PATCHES_MAX; i++) {
        MildPatch patch = {2.0 + i, 3.0 + i, 0.0, 1.0, 1};
        assert_int_equal(mild_terrain_add_patch(&terrain, &patch, &error), MILD_OK);
    }
    MildPatch last = {90.0, 91.0, 0.0, 1.0, 1};
    assert_refused(mild_terrain_add_patch(&terrain, &last, &error), MILD_ERROR_ARGUMENT, &error,
                   "terrain.patch_count 16");
}

TEST(test_sole_counts) {
    for (int target = 0; target <= 77; target += 77) {
        MildSole *left = kit_sole(0, target), *right = kit_sole(1, target);
        int n = mild_sole_elements(left);
        assert_int_equal(n, mild_sole_elements(right));
        assert_int_equal(n, target ? target : 64);
        for (int i = 0; i < n; i++) { /* the right sole mirrors the left one */
            int found = 0;
            for (int j = 0; j < n; j++) {
                found += fabs(mild_sole_x(left)[i] - mild_sole_x(right)[j]) < 1e-9 &&
                         fabs(mild_sole_y(left)[i] + mild_sole_y(right)[j]) < 1e-9;
            }
            assert_int_equal(found, 1);
        }
        mild_sole_destroy(left);
        mild_sole_destroy(right);
    }
    for (int n = 1; n <= 90; n++) {
        double box[8] = {-0.075, -0.045, 0.195, -0.045, 0.195, 0.055, -0.075, 0.055};
        MildSoleDef def = {box, 4, KIT_PITCH, KIT_SOLE_Z, n};
        MildError error = {0};
        MildSole *sole = mild_sole_create(&def, &error);
        if (!sole) {
            assert_true(n > 77);
            assert_error(&error, MILD_ERROR_RANGE, "sole.target_elements sole.pitch");
            continue;
        }
        assert_int_equal(mild_sole_elements(sole), n);
        mild_sole_destroy(sole);
    }
}

/* An L of four whole cells, wherever it lies: each is one element, column by column. */
TEST(test_sole_places) {
    static const double corner[12] = {0, 0, 3, 0, 3, 1, 1, 1, 1, 2, 0, 2};
    static const double place[4][2] = {{0.5, 0.5}, {0.5, 1.5}, {1.5, 0.5}, {2.5, 0.5}};
    for (int target = 0; target <= 4; target += 4) {
        double outline[12];
        for (int k = 0; k < 12; k++) {
            outline[k] = KIT_PITCH * corner[k] + (k % 2 ? -0.03 : 0.11);
        }
        MildSoleDef def = {outline, 6, KIT_PITCH, KIT_SOLE_Z, target};
        MildError error = {0};
        MildSole *sole = mild_sole_create(&def, &error);
        assert_non_null(sole);
        assert_int_equal(mild_sole_elements(sole), 4);
        for (int i = 0; i < 4; i++) {
            assert_true(fabs(mild_sole_x(sole)[i] - KIT_PITCH * place[i][0] - 0.11) < 1e-12);
            assert_true(fabs(mild_sole_y(sole)[i] - KIT_PITCH * place[i][1] + 0.03) < 1e-12);
        }
        mild_sole_destroy(sole);
    }
}

/* The raster may have 65536 cells, a border of one around the outline's box included. */
TEST(test_sole_sizes) {
    for (int more = 0; more < 2; more++) {
        const double edge = 0.254 + 0.0001 * more;
        double box[8] = {0, 0, edge, 0, edge, 0.25399, 0, 0.25399};
        MildSoleDef def = {box, 4, 1e-3, KIT_SOLE_Z, 0};
        MildError error = {0};
        MildSole *sole = mild_sole_create(&def, &error);
        assert_true((sole == NULL) == more);
        if (more) {
            assert_error(&error, MILD_ERROR_RANGE, "sole.pitch 0.001 65536");
        } else {
            assert_int_equal(mild_sole_elements(sole), 254 * 254);
        }
        mild_sole_destroy(sole);
    }
}

TEST(test_sole_refused) {
    double square[8] = {0, 0, 0.1, 0, 0.1, 0.1, 0, 0.1}, bow[8] = {0, 0, 0.1, 0.1, 0.1, 0, 0, 0.12};
    static double many[2 * 5000];
    double line[8] = {0, 0, 0.1, 0, 0.2, 0, 0.3, 0}, nan[8] = {0, 0, NAN, 0, 0.1, 0.1, 0, 0.1};
    const struct {
        MildSoleDef def;
        MildStatus status;
        const char *names;
    } bad[] = {{{square, 2, KIT_PITCH, 0, 0}, MILD_ERROR_ARGUMENT, "sole.points 2 3"},
               {{NULL, 4, KIT_PITCH, 0, 0}, MILD_ERROR_ARGUMENT, "sole.points 3"},
               {{square, 4, 9e-4, 0, 0}, MILD_ERROR_RANGE, "sole.pitch 0.0009"},
               {{square, 4, NAN, 0, 0}, MILD_ERROR_RANGE, "sole.pitch nan"},
               {{square, 4, KIT_PITCH, NAN, 0}, MILD_ERROR_RANGE, "sole.sole_z nan"},
               {{square, 4, KIT_PITCH, 0, -1}, MILD_ERROR_RANGE, "sole.target_elements -1"},
               {{many, 5000, KIT_PITCH, 0, 0}, MILD_ERROR_RANGE, "sole.points 5000 4096"},
               {{square, 4, KIT_PITCH, 0, 500}, MILD_ERROR_RANGE, "sole.target_elements 500"},
               {{bow, 4, KIT_PITCH, 0, 0}, MILD_ERROR_ARGUMENT, "sole.outline 0 2"},
               {{line, 4, KIT_PITCH, 0, 0}, MILD_ERROR_RANGE, "sole.outline"},
               {{nan, 4, KIT_PITCH, 0, 0}, MILD_ERROR_RANGE, "sole.outline"}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        MildError error = {0};
        assert_null(mild_sole_create(&bad[i].def, &error));
        assert_error(&error, bad[i].status, bad[i].names);
    }
}

/* Every number of a foot's input in turn becomes NaN, infinite or huge: the step comes back, what
 * it calls converged is finite, and the ground keeps its bytes where it is not. Then the scratch
 * solves the sound step as before. The fuzz target tests/fuzz/fuzz_solve.c goes further. */
TEST(test_hostile_numbers) {
    static const double hostile[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300};
    static const int counts[] = {3, 9, 6, 36, 6};
    const MildMaterial material = mild_material_default();
    MildSole *sole = kit_plate(3, 2);
    int kept = 0;
    for (int test = 0; test < 4 * 5 * 60; test++) {
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &material, 1e-3);
        kit_prints(&kit, test / 2 % 2 ? 64 : 0);
        kit.input.position[0][2] += test % 2 ? 1.0 : -0.01; /* in the air, in the ground */
        kit_inverse_inertia(&kit);
        kit_free(&kit, NULL);
        kit_solve(&kit);
        const MildContactResult sound = kit.result;
        void *before = malloc(kit.bytes);
        memcpy(before, kit.ground, kit.bytes);
        double *const areas[] = {kit.input.position[0], kit.input.rotation[0],
                                 kit.input.velocity[0], kit.input.inverse_inertia,
                                 kit.input.free_velocity};
        int area = 0, index = test / 20;
        while (index >= counts[area]) {
            index -= counts[area++];
        }
        double *number = &areas[area][index];
        const double good = *number;
        *number = hostile[test / 4 % 5];
        kit.input.solver = test % 3 ? MILD_SOLVER_NEWTON : MILD_SOLVER_GAUSS_SEIDEL;
        kit_solve(&kit);
        const MildFootResult *foot = &kit.result.foot[0];
        double sum = 0.0;
        for (int i = 0; i < 6; i++) {
            sum += kit.result.velocity[i] + (i < 3 ? foot->force[i] : foot->torque[i - 3]);
        }
        assert_true(!kit.result.converged || isfinite(sum));
        assert_true(!kit.result.converged || area >= 2 || fabs(*number) == 1e300);
        mild_ground_advance(kit.ground, &kit.terrain, &kit.input, kit.scratch, &kit.result);
        if (!kit.result.converged && !isfinite(*number)) {
            assert_memory_equal(kit.ground, before, kit.bytes);
            kept++;
        }
        memcpy(kit.ground, before, kit.bytes);
        *number = good;
        kit.input.solver = MILD_SOLVER_NEWTON;
        kit_solve(&kit);
        assert_memory_equal(&kit.result, &sound, sizeof sound);
        free(before);
        kit_close(&kit);
    }
    assert_true(kept > 300);
    mild_sole_destroy(sole);
}

/* A material that nobody checked: a step on NaN is not called converged, the next one on sound
 * ground is. */
TEST(test_hostile_material) {
    static const char *const used[] = {"k_pen",   "sigma_cone", "alpha",    "nu",
                                       "phi",     "rho",        "mu",       "k_drift",
                                       "b_drift", "recovery",   "bed_depth"};
    MildSole *sole = kit_plate(3, 2);
    MildMaterial sound = mild_material_default();
    Kit kit;
    kit_open(&kit, 1, sole, NULL, &sound, 1e-3);
    kit.input.position[0][2] -= 0.01;
    kit_inverse_inertia(&kit);
    kit_free(&kit, NULL);
    for (size_t i = 0; i < sizeof used / sizeof *used; i++) {
        for (int solver = 0; solver < 2; solver++) {
            kit.input.solver = (MildSolver)solver;
            for (int f = 0; f < mild_material_field_count; f++) {
                if (strcmp(mild_material_fields[f].name, used[i]) == 0) {
                    *(double *)((char *)&kit.terrain.materials[0] +
                                mild_material_fields[f].offset) = NAN;
                }
            }
            kit_solve(&kit);
            assert_int_equal(kit.result.converged, 0);
            kit.terrain.materials[0] = sound;
            kit_solve(&kit);
            assert_int_equal(kit.result.converged, 1);
        }
    }
    kit_close(&kit);
    mild_sole_destroy(sole);
}

/* mild_contact_check: random problems pass, in double and rounded to float, and each fault has its
 * message. */

static MildSole *soles[2]; /* left, right */

static int open_soles(void **state) {
    (void)state;
    soles[0] = kit_sole(0, 77);
    soles[1] = kit_sole(1, 77);
    return 0;
}

static int close_soles(void **state) {
    (void)state;
    mild_sole_destroy(soles[0]);
    mild_sole_destroy(soles[1]);
    return 0;
}

static MildStatus check(const Kit *kit, MildError *error) {
    return mild_contact_check(kit->ground, &kit->terrain, &kit->input, error);
}

/* A - 1.5 v v^T with v = A w / sqrt(w^T A w) gives w^T A w the other sign, halved. */
static void turn_negative(Kit *kit, uint64_t *random) {
    const int n = 6 * kit->feet;
    double *a = kit->input.inverse_inertia, w[6 * MILD_FEET_MAX], v[6 * MILD_FEET_MAX], square = 0;
    for (int i = 0; i < n; i++) {
        w[i] = kit_uniform(random, -1, 1) / sqrt(a[i * n + i]);
    }
    for (int i = 0; i < n; i++) {
        v[i] = 0;
        for (int j = 0; j < n; j++) {
            v[i] += a[i * n + j] * w[j];
        }
        square += w[i] * v[i];
    }
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            a[i * n + j] -= 1.5 * v[i] * v[j] / square;
        }
    }
}

TEST(random_problems) {
    uint64_t random = 9;
    for (int draw = 0; draw < kit_draws(1000); draw++) {
        Kit kit;
        MildError error = {0};
        const MildMaterial material = kit_material(&random);
        const int feet = 1 + draw % 2;
        kit_open(&kit, feet, soles[0], soles[1], &material, 1e-3);
        kit_random_state(&kit, &random);
        kit_random_inertia(&kit, &random, 1 + kit_index(&random, 6 * feet)); /* of any rank */
        kit_free(&kit, NULL);
        if (check(&kit, &error) != MILD_OK) {
            fail_msg("draw %d: %s", draw, error.text);
        }
        kit_round(kit.input.inverse_inertia, (size_t)(36 * kit.feet * kit.feet));
        if (check(&kit, &error) != MILD_OK) {
            fail_msg("draw %d in float: %s", draw, error.text);
        }
        turn_negative(&kit, &random);
        assert_refused(check(&kit, &error), MILD_ERROR_ARGUMENT, &error, "input.inverse_inertia");
        kit_close(&kit);
    }
}

/* Each fault as a change of one number of a good problem of two feet. */
TEST(faults) {
    static Kit kit;
    uint64_t random = 4;
    const MildMaterial foam = kit_material(&random);
    kit_open(&kit, 2, soles[0], soles[1], &foam, 1e-3);
    kit_random_state(&kit, &random);
    kit_random_inertia(&kit, &random, 12);
    kit_free(&kit, NULL);
    MildContactInput *in = &kit.input;
    double *a = in->inverse_inertia;
    const struct {
        double *number, value;
        MildStatus status;
        const char *names;
    } cases[] = {
        {&in->dt, 1e-50, MILD_ERROR_RANGE, "input.dt 1e-50"},
        {&in->dt, NAN, MILD_ERROR_RANGE, "input.dt nan"},
        {&in->dt, INFINITY, MILD_ERROR_RANGE, "input.dt inf"},
        {&in->position[1][2], NAN, MILD_ERROR_ARGUMENT, "input.position 1 2 nan"},
        {&in->velocity[0][5], INFINITY, MILD_ERROR_ARGUMENT, "input.velocity 0 5 inf"},
        {&in->free_velocity[7], NAN, MILD_ERROR_ARGUMENT, "input.free_velocity foot 1 nan"},
        {&in->rotation[0][4], 2, MILD_ERROR_ARGUMENT, "input.rotation foot 0 1"},
        {&in->rotation[1][8], NAN, MILD_ERROR_ARGUMENT, "input.rotation foot 1 nan"},
        {&a[13 * 7], -1e-3, MILD_ERROR_ARGUMENT, "input.inverse_inertia row 7 -0.001"},
        {&a[13 * 2], NAN, MILD_ERROR_ARGUMENT, "input.inverse_inertia row 2 nan"},
        {&a[12 * 3 + 1], 9, MILD_ERROR_ARGUMENT, "input.inverse_inertia row 1 column 3 9"},
        {&a[12 * 3 + 1], NAN, MILD_ERROR_ARGUMENT, "input.inverse_inertia row 1 column 3 nan"},
        {&a[13 * 4], 0, MILD_ERROR_ARGUMENT, "input.inverse_inertia row"},
        {&kit.terrain.height, NAN, MILD_ERROR_ARGUMENT, "terrain.height nan"},
        {&kit.terrain.materials[0].mu, -1, MILD_ERROR_RANGE, "ground.mu -1"},
    };
    MildError error = {0};
    assert_int_equal(check(&kit, &error), MILD_OK);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const double kept = *cases[i].number;
        *cases[i].number = cases[i].value;
        assert_refused(check(&kit, &error), cases[i].status, &error, cases[i].names);
        *cases[i].number = kept;
        assert_int_equal(check(&kit, NULL), MILD_OK);
    }
    for (int i = 0; i < 3; i++) { /* x turned round: still orthonormal */
        in->rotation[1][3 * i] *= -1;
    }
    assert_refused(check(&kit, &error), MILD_ERROR_ARGUMENT, &error,
                   "input.rotation foot 1 mirror");
    for (int i = 0; i < 9; i++) { /* twice as long */
        in->rotation[0][i] *= 2;
    }
    assert_refused(check(&kit, &error), MILD_ERROR_ARGUMENT, &error, "input.rotation foot 0 4");
    in->feet = 1;
    assert_refused(check(&kit, &error), MILD_ERROR_ARGUMENT, &error, "input.feet 1 2");
    kit.terrain.material_count = 0;
    assert_refused(check(&kit, &error), MILD_ERROR_RANGE, &error, "terrain.material_count 0");
    kit_close(&kit);
}

/* Patches and a map, in places where the functions that set them do not look again. */
TEST(places) {
    static Kit kit;
    uint64_t random = 4;
    const MildMaterial foam = kit_material(&random);
    MildMapDef def = shape(MILD_MAP_FLAT, 0, 1);
    def.patches = MILD_PATTERN_CHECKER;
    def.patch_count = 2;
    MildMap *map = make_map(&def);
    MildError error = {0};
    kit_open(&kit, 1, soles[0], soles[0], &foam, 1e-3);
    kit_random_state(&kit, &random);
    kit_random_inertia(&kit, &random, 6);
    kit.terrain.material_count = 2;
    kit.terrain.materials[1] = foam;
    kit.terrain.patches[0] = (MildPatch){.x_max = 1, .y_max = 1, .material = 1};
    kit.terrain.patch_count = 1;
    kit.terrain.map = map;
    assert_int_equal(check(&kit, &error), MILD_OK);
    kit.terrain.patches[0].material = 2;
    assert_refused(check(&kit, &error), MILD_ERROR_RANGE, &error,
                   "terrain.patches patch 0 material 2");
    kit.terrain.patch_count = MILD_PATCHES_MAX + 1;
    assert_refused(check(&kit, &error), MILD_ERROR_RANGE, &error, "terrain.patch_count 17");
    kit.terrain.patch_count = 0;
    kit.terrain.map_y = NAN;
    assert_refused(check(&kit, &error), MILD_ERROR_ARGUMENT, &error, "map_y nan");
    kit.terrain.material_count = 1;
    assert_refused(check(&kit, &error), MILD_ERROR_RANGE, &error, "terrain.map label 1");
    kit_close(&kit);
    mild_map_destroy(map);
}

/* A scratch for other soles than the ground's, of which the last is a shell of as many elements:
 * nothing is computed, and nothing written. */
TEST(another_scratch) {
    static Kit kit;
    uint64_t random = 4;
    Plate36 plate;
    const MildMaterial foam = kit_material(&random);
    const MildShape shape = surface_plate(5, 4, KIT_SOLE_Z, &plate);
    MildSole *small = kit_plate(5, 4), *face = surface_make(&shape, 1, KIT_PITCH);
    const MildSole *const others[][3] = {
        {soles[0]}, {soles[0], soles[1]}, {soles[0], small, small}, {soles[0], face}};
    static const int feet[] = {1, 2, 3, 2};
    const MildSole *const own[2] = {soles[0], small};
    kit_open(&kit, 2, soles[0], soles[1], &foam, 1e-3);
    kit_soles(&kit, own);
    kit_random_state(&kit, &random);
    kit_random_inertia(&kit, &random, 12);
    kit_free(&kit, NULL);
    kit_solve(&kit);
    kit_advance(&kit);
    char *before = malloc(kit.bytes);
    memcpy(before, kit.ground, kit.bytes);
    for (int i = 0; i < 4; i++) {
        MildScratch *scratch = mild_scratch_create(others[i], feet[i], NULL);
        mild_ground_solve(kit.ground, &kit.terrain, &kit.input, scratch, &kit.result);
        assert_int_equal(kit.result.converged, 0);
        assert_memory_equal(kit.result.velocity, kit.input.free_velocity,
                            6 * (size_t)(feet[i] < 2 ? 1 : 2) * sizeof(double));
        mild_ground_advance(kit.ground, &kit.terrain, &kit.input, scratch, &kit.result);
        assert_memory_equal(kit.ground, before, kit.bytes);
        mild_scratch_destroy(scratch);
    }
    free(before);
    kit_close(&kit);
    mild_sole_destroy(small);
    mild_sole_destroy(face);
}

/* A ground that walked over waves and was reset is that of the first day, byte by byte. */
TEST(reset_is_new) {
    static Kit kit, fresh;
    const MildMaterial sand = mild_material_default();
    const MildMapDef def = shape(MILD_MAP_WAVES, 0.03, 0.5);
    MildMap *map = make_map(&def);
    kit_open(&kit, 2, soles[0], soles[1], &sand, 1e-3);
    kit_open(&fresh, 2, soles[0], soles[1], &sand, 1e-3);
    kit.terrain = terrain_on(map, 0);
    for (int s = 0; s < 20; s++) {
        kit_step(&kit, NULL);
    }
    assert_memory_not_equal(kit.ground, fresh.ground, kit.bytes);
    mild_ground_reset(kit.ground);
    assert_memory_equal(kit.ground, fresh.ground, kit.bytes);
    kit_close(&kit);
    kit_close(&fresh);
    mild_map_destroy(map);
}

/* A foot that a rail guides: rows of 0, which nothing may be coupled to. */
TEST(rows_of_zero) {
    static Kit kit;
    uint64_t random = 4;
    const MildMaterial foam = kit_material(&random);
    kit_open(&kit, 1, soles[0], soles[0], &foam, 1e-3);
    kit_random_state(&kit, &random);
    memset(kit.A, 0, sizeof kit.A);
    kit.input.inverse_inertia[7 * 2] = 0.1;
    MildError error = {0};
    assert_int_equal(check(&kit, &error), MILD_OK);
    kit.input.inverse_inertia[6 * 2 + 3] = kit.input.inverse_inertia[6 * 3 + 2] = 1e-9;
    assert_true(check(&kit, &error) != MILD_OK);
    kit_close(&kit);
}

TEST(too_many_feet) {
    const MildSole *many[MILD_FEET_MAX + 1];
    double block[16] = {1};
    for (int f = 0; f <= MILD_FEET_MAX; f++) {
        many[f] = soles[0];
    }
    assert_true(mild_ground_bytes(many, MILD_FEET_MAX + 1) == 0 && mild_ground_bytes(many, 0) == 0);
    assert_null(mild_ground_init(block, many, MILD_FEET_MAX + 1));
    assert_null(mild_ground_init(NULL, many, 1));
    assert_true(block[0] == 1);
}

TEST_MAIN(open_soles, close_soles)
