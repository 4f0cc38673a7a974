/* mild_contact_check: random problems pass, in double and rounded to float, and each fault has its
 * message. */
#include "map_kit.h"
#include "surface_kit.h"

#include "draws.h"

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
        assert_int_equal(check(&kit, &error), MILD_ERROR_ARGUMENT);
        assert_error(&error, MILD_ERROR_ARGUMENT, "input.inverse_inertia");
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
        {&in->dt, 0, MILD_ERROR_RANGE, "input.dt 0"},
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
        assert_int_equal(check(&kit, &error), cases[i].status);
        assert_error(&error, cases[i].status, cases[i].names);
        *cases[i].number = kept;
        assert_int_equal(check(&kit, NULL), MILD_OK);
    }
    for (int i = 0; i < 3; i++) { /* x turned round: still orthonormal */
        in->rotation[1][3 * i] *= -1;
    }
    assert_true(check(&kit, &error) != MILD_OK);
    assert_error(&error, MILD_ERROR_ARGUMENT, "input.rotation foot 1 mirror");
    for (int i = 0; i < 9; i++) { /* twice as long */
        in->rotation[0][i] *= 2;
    }
    assert_true(check(&kit, &error) != MILD_OK);
    assert_error(&error, MILD_ERROR_ARGUMENT, "input.rotation foot 0 4");
    in->feet = 1;
    assert_true(check(&kit, &error) != MILD_OK);
    assert_error(&error, MILD_ERROR_ARGUMENT, "input.feet 1 2");
    kit.terrain.material_count = 0;
    assert_true(check(&kit, &error) != MILD_OK);
    assert_error(&error, MILD_ERROR_RANGE, "terrain.material_count 0");
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
    assert_true(check(&kit, &error) != MILD_OK);
    assert_error(&error, MILD_ERROR_RANGE, "terrain.patches patch 0 material 2");
    kit.terrain.patch_count = MILD_PATCHES_MAX + 1;
    assert_true(check(&kit, &error) != MILD_OK);
    assert_error(&error, MILD_ERROR_RANGE, "terrain.patch_count 17");
    kit.terrain.patch_count = 0;
    kit.terrain.map_y = NAN;
    assert_true(check(&kit, &error) != MILD_OK);
    assert_error(&error, MILD_ERROR_ARGUMENT, "map_y nan");
    kit.terrain.material_count = 1;
    assert_true(check(&kit, &error) != MILD_OK);
    assert_error(&error, MILD_ERROR_RANGE, "terrain.map label 1");
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
