/* mild_contact_check: random problems pass, in double and rounded to float, and each fault has its
 * message. */
#include "ground_kit.h"

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

static void random_problems(void **state) {
    (void)state;
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
        for (int i = 0; i < 36 * kit.feet * kit.feet; i++) {
            kit.input.inverse_inertia[i] = (float)kit.input.inverse_inertia[i];
        }
        if (check(&kit, &error) != MILD_OK) {
            fail_msg("draw %d in float: %s", draw, error.text);
        }
        turn_negative(&kit, &random);
        assert_true(check(&kit, &error) != MILD_OK);
        assert_non_null(strstr(error.text, "input.inverse_inertia"));
        kit_close(&kit);
    }
}

/* Each fault as a change of one number of a good problem of two feet. */
static void faults(void **state) {
    (void)state;
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
        const char *message;
    } cases[] = {
        {&in->dt, 0, "input.dt = 0 "},
        {&in->dt, NAN, "input.dt"},
        {&in->dt, INFINITY, "input.dt"},
        {&in->position[1][2], NAN, "input.position of foot 1: number 2 is nan"},
        {&in->velocity[0][5], INFINITY, "input.velocity of foot 0: number 5"},
        {&in->free_velocity[7], NAN, "input.free_velocity of foot 1: number 1"},
        {&in->rotation[0][4], 2, "input.rotation of foot 0 is not orthonormal"},
        {&in->rotation[1][8], NAN, "input.rotation of foot 1 is not orthonormal"},
        {&a[13 * 7], -1e-3, "row 7 has -0.001 on the diagonal"},
        {&a[13 * 2], NAN, "row 2 has nan on the diagonal"},
        {&a[12 * 3 + 1], 9, "row 1 column 3 is"},
        {&a[12 * 3 + 1], NAN, "not symmetric"},
        {&a[13 * 4], 0, "inverse_inertia"},
        {&kit.terrain.height, NAN, "terrain.height"},
        {&kit.terrain.materials[0].mu, -1, "ground.mu = -1"},
    };
    MildError error = {0};
    assert_int_equal(check(&kit, &error), MILD_OK);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const double kept = *cases[i].number;
        *cases[i].number = cases[i].value;
        assert_true(check(&kit, &error) != MILD_OK);
        if (!strstr(error.text, cases[i].message)) {
            fail_msg("'%s' is not in '%s'", cases[i].message, error.text);
        }
        *cases[i].number = kept;
        assert_int_equal(check(&kit, NULL), MILD_OK);
    }
    for (int i = 0; i < 3; i++) { /* x turned round: still orthonormal */
        in->rotation[1][3 * i] *= -1;
    }
    assert_true(check(&kit, &error) != MILD_OK);
    assert_non_null(strstr(error.text, "input.rotation of foot 1 is a mirror image"));
    for (int i = 0; i < 9; i++) { /* twice as long */
        in->rotation[0][i] *= 2;
    }
    assert_true(check(&kit, &error) != MILD_OK);
    assert_non_null(strstr(error.text, "foot 0 is not orthonormal: columns 0 and 0 multiply to 4"));
    in->feet = 1;
    assert_true(check(&kit, &error) != MILD_OK);
    assert_string_equal(error.text, "input.feet = 1, but the ground has 2");
    kit.terrain.material_count = 0;
    assert_true(check(&kit, &error) != MILD_OK);
    assert_non_null(strstr(error.text, "terrain.material_count = 0"));
    kit_close(&kit);
}

/* A foot that a rail guides: rows of 0, which nothing may be coupled to. */
static void rows_of_zero(void **state) {
    (void)state;
    static Kit kit;
    uint64_t random = 4;
    const MildMaterial foam = kit_material(&random);
    kit_open(&kit, 1, soles[0], soles[0], &foam, 1e-3);
    kit_random_state(&kit, &random);
    memset(kit.input.inverse_inertia, 0, sizeof kit.input.inverse_inertia);
    kit.input.inverse_inertia[7 * 2] = 0.1;
    MildError error = {0};
    assert_int_equal(check(&kit, &error), MILD_OK);
    kit.input.inverse_inertia[6 * 2 + 3] = kit.input.inverse_inertia[6 * 3 + 2] = 1e-9;
    assert_true(check(&kit, &error) != MILD_OK);
    kit_close(&kit);
}

static void too_many_feet(void **state) {
    (void)state;
    const MildSole *five[] = {soles[0], soles[0], soles[0], soles[0], soles[0]};
    double block[16] = {1};
    assert_true(mild_ground_bytes(five, 5) == 0 && mild_ground_bytes(five, 0) == 0);
    assert_null(mild_ground_init(block, five, 5));
    assert_null(mild_ground_init(NULL, five, 1));
    assert_true(block[0] == 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_problems),
        cmocka_unit_test(faults),
        cmocka_unit_test(rows_of_zero),
        cmocka_unit_test(too_many_feet),
    };
    return cmocka_run_group_tests(tests, open_soles, close_soles);
}
