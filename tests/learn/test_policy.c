/* Acting, and the policy's file: round trip, damage of every kind, a full disk, memory running out.
 */
#include "check.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "files.h"
#include "learn/policy_private.h"
#include "learn/ppo.h"
#include "learn/safetensors.h"

#define PATH "build_test_policy.safetensors"

/* What the critic says of rows that lie together. */
static void values_of(Policy *policy, int rows, const float *critic, float *values) {
    const PolicyRows all = {.blocks = 1, .runs = 1, .cut = {0, rows}};
    policy_value_rows(policy, NULL, &all, critic, values);
}

static Policy *small_policy(uint64_t seed) {
    MildError error = {0};
    PolicyDef def = small_def();
    Policy *policy = policy_create(&def, seed, &error);
    assert_non_null(policy);
    return policy;
}

/* Left behind by a save of PATH. */
static int temporary_files(void) {
    int count = 0;
    DIR *dir = opendir(".");
    assert_non_null(dir);
    for (struct dirent *entry; (entry = readdir(dir));) {
        count +=
            strncmp(entry->d_name, PATH, strlen(PATH)) == 0 && file_is_temporary(entry->d_name);
    }
    closedir(dir);
    return count;
}

static size_t parameter_bytes(const Policy *policy) {
    return (size_t)policy_parameter_count(policy) * sizeof(float);
}

/* Rows in blocks and runs, as the learner has them: each row once, and the same bits whether a
 * process has both runs of a block or one of them. */
TEST(test_rows_in_runs) {
    enum { BLOCKS = 3, FIRST = 150, SECOND = 31, WIDTH = FIRST + SECOND, ROWS = BLOCKS * WIDTH };
    PolicyDef def = policy_def_default();
    def.critic_input = 98;
    Policy *policy = policy_create(&def, 3, NULL);
    Pool *pool = pool_create(3);
    assert_true(policy && pool);
    Random random = random_at(6, 0, 0);
    static float history[ROWS * 282], critic[ROWS * 98], part[BLOCKS * SECOND * 282];
    static float actions[3][ROWS * 12], values[3][ROWS];
    fill_normal(history, ROWS * 282, 1.0, &random);
    fill_normal(critic, ROWS * 98, 1.0, &random);
    const PolicyRows both = {.blocks = BLOCKS, .runs = 2, .cut = {0, FIRST, WIDTH}},
                     second = {.blocks = BLOCKS, .runs = 1, .cut = {0, SECOND}};
    memset(actions[1], 0xff, sizeof actions[1]);
    memset(values[1], 0xff, sizeof values[1]);
    policy_act(policy, NULL, ROWS, history, actions[0], NULL, NULL);
    values_of(policy, ROWS, critic, values[0]);
    policy_act_rows(policy, pool, &both, history, NULL, actions[1]);
    policy_value_rows(policy, pool, &both, critic, values[1]);
    for (int i = 0; i < ROWS * 12; i++) {
        assert_true(fabs((double)actions[1][i] - (double)actions[0][i]) < 1e-5);
        assert_true(fabs((double)values[1][i / 12] - (double)values[0][i / 12]) < 1e-5);
    }
    for (int block = 0; block < BLOCKS; block++) {
        memcpy(part + block * SECOND * 282, history + (block * WIDTH + FIRST) * 282,
               SECOND * 282 * sizeof *part);
    }
    policy_act_rows(policy, NULL, &second, part, NULL, actions[2]);
    for (int block = 0; block < BLOCKS; block++) {
        memcpy(part + block * SECOND * 98, critic + (block * WIDTH + FIRST) * 98,
               SECOND * 98 * sizeof *part);
    }
    policy_value_rows(policy, NULL, &second, part, values[2]);
    for (int block = 0; block < BLOCKS; block++) {
        assert_memory_equal(actions[2] + block * SECOND * 12,
                            actions[1] + (block * WIDTH + FIRST) * 12, SECOND * 12 * sizeof(float));
        assert_memory_equal(values[2] + block * SECOND, values[1] + block * WIDTH + FIRST,
                            SECOND * sizeof(float));
    }
    policy_destroy(policy);
    pool_destroy(pool);
}

/* What the policy answers, from its equations: the encoder's first heads are the estimates, the
 * next mu; latent = theta1 mu + theta2 with theta from the feet velocities; the actor reads the
 * newest frame, the estimates, the latent. Three chunks of rows, the last not full. */
TEST(test_answers) {
    enum { ROWS = 300 };
    static float history[ROWS * 15], actions[ROWS * 2], estimates[ROWS * 6], latent[ROWS * 4],
        critic[ROWS * 7], values[ROWS];
    Policy *policy = small_policy(9);
    const Network *n = &policy->network;
    double *p = malloc((size_t)n->count * sizeof *p);
    assert_non_null(p);
    Random random = random_at(12, 0, 0);
    fill_normal(policy->parameters, n->count, 0.4, &random);
    for (int64_t i = 0; i < n->count; i++) {
        p[i] = (double)policy->parameters[i];
    }
    fill_normal(history, ROWS * 15, 1.0, &random);
    fill_normal(critic, ROWS * 7, 1.0, &random);
    policy_act(policy, NULL, ROWS, history, actions, estimates, latent);
    values_of(policy, ROWS, critic, values);
    for (int r = 0; r < ROWS; r++) {
        double x[64], heads[64], theta[64], input[64], mean[64], value[64];
        for (int i = 0; i < 15; i++) {
            x[i] = (double)history[r * 15 + i];
        }
        mlp_double(&n->encoder, p, x, heads);
        mlp_double(&n->modulation, p, heads + n->def.feet_velocity_offset, theta);
        memcpy(input, x + 10, 5 * sizeof *x);
        for (int i = 0; i < 6; i++) {
            input[5 + i] = heads[i];
            expect_entry("estimate", i, (double)estimates[r * 6 + i], heads[i], 3e-5);
        }
        for (int i = 0; i < 4; i++) {
            int each = n->def.modulation_per_dimension;
            input[11 + i] = theta[each ? i : 0] * heads[6 + i] + theta[each ? 4 + i : 1];
            expect_entry("latent", i, (double)latent[r * 4 + i], input[11 + i], 3e-5);
        }
        mlp_double(&n->actor, p, input, mean);
        for (int i = 0; i < 2; i++) {
            expect_entry("action", i, (double)actions[r * 2 + i], mean[i], 3e-5);
        }
        for (int i = 0; i < 7; i++) {
            x[i] = (double)critic[r * 7 + i];
        }
        mlp_double(&n->critic, p, x, value);
        expect_entry("value", r, (double)values[r], value[0], 3e-5);
    }
    free(p);
    policy_destroy(policy);
}

/* Acts on the same numbers but for the clock of the frames, which ends each: bool, what changed. */
typedef struct {
    int actions, estimates, latent, theta;
} Changed;

static Changed change_clock(Policy *policy, const PolicyInstead *instead) {
    enum { ROWS = 3 };
    float history[2][ROWS * 15], actions[2][ROWS * 2], estimates[2][ROWS * 6], latent[2][ROWS * 4],
        theta[2][ROWS * 2];
    Random random = random_at(13, 0, 0);
    fill_normal(history[0], ROWS * 15, 1.0, &random);
    fill_normal(history[1], ROWS * 15, 1.0, &random);
    for (int k = 0; k < 2; k++) {
        const PolicyInside inside = {
            .estimates = estimates[k], .latent = latent[k], .theta = theta[k]};
        for (int i = 0; i < ROWS * 15; i++) {
            history[k][i] = i % 5 < 3 ? history[0][i] : history[k][i];
        }
        policy_act_inside(policy, NULL, ROWS, history[k], instead, actions[k], &inside);
    }
    return (Changed){memcmp(actions[0], actions[1], sizeof actions[0]) != 0,
                     memcmp(estimates[0], estimates[1], sizeof estimates[0]) != 0,
                     memcmp(latent[0], latent[1], sizeof latent[0]) != 0,
                     memcmp(theta[0], theta[1], sizeof theta[0]) != 0};
}

/* A policy with weights in the place of those that start as 0, so that theta and the actions depend
 * on all that they may. */
static Policy *clock_policy(int input, int sees) {
    MildError error = {0};
    PolicyDef def = small_def();
    def.modulation_input = input;
    def.actor_phase = sees;
    Policy *policy = policy_create(&def, 9, &error);
    assert_non_null(policy);
    const Mlp *mlp = &policy->network.modulation;
    const MlpLayer *last = &mlp->layer[mlp->layers - 1];
    Random random = random_at(14, 0, 0);
    fill_normal(policy->parameters + last->weight, last->bias - last->weight, 0.5, &random);
    return policy;
}

/* With actor_phase = false the clock changes the actions through theta or not at all, from the
 * first weights on. */
TEST(test_actor_without_the_clock) {
    static const float theta[2] = {0.7f, -0.2f};
    const PolicyInstead instead = {.theta = theta};
    for (int input = 0; input < POLICY_INPUTS; input++) {
        Policy *seeing = clock_policy(input, 1), *blind = clock_policy(input, 0);
        const Changed own = change_clock(blind, NULL), held = change_clock(blind, &instead),
                      usual = change_clock(seeing, &instead);
        assert_int_equal(own.theta, input == POLICY_INPUT_FEET_PHASE);
        assert_int_equal(own.actions, input == POLICY_INPUT_FEET_PHASE);
        assert_false(own.estimates || own.latent);
        assert_false(held.actions);
        assert_true(usual.actions && usual.estimates && usual.latent && usual.theta);
        assert_true(policy_take_networks(blind, seeing)); /* which must not bring the clock */
        assert_false(change_clock(blind, &instead).actions || change_clock(blind, NULL).latent);
        policy_destroy(seeing);
        policy_destroy(blind);
    }
    Policy *velocities = clock_policy(POLICY_INPUT_FEET, 1),
           *clock = clock_policy(POLICY_INPUT_FEET_PHASE, 1);
    assert_false(policy_take_networks(clock, velocities));
    policy_destroy(velocities);
    policy_destroy(clock);
}

/* A policy with a scan takes one without: actions and values are the same, whatever is seen, and
 * the noise is its own. */
TEST(test_scan_begins_unseen) {
    enum { SCAN = 3, FRAMES = 15, CRITIC = 7 };
    PolicyDef def = small_def();
    Policy *blind = clock_policy(POLICY_INPUT_FEET, 1);
    def.scan = SCAN;
    def.critic_input += SCAN;
    def.init_std = 0.3;
    Policy *seeing = policy_create(&def, 3, NULL), *again = policy_create(&def, 4, NULL);
    Random random = random_at(15, 0, 0);
    float history[FRAMES + SCAN], critic[CRITIC + SCAN], actions[2][2], values[2];
    const PolicyRows one = {.blocks = 1, .runs = 1, .cut = {0, 1}};
    fill_normal(history, FRAMES + SCAN, 1.0, &random);
    fill_normal(critic, CRITIC + SCAN, 1.0, &random);
    assert_false(policy_take_networks(blind, seeing));
    assert_true(policy_take_networks(seeing, blind));
    policy_act(blind, NULL, 1, history, actions[0], NULL, NULL);
    policy_act(seeing, NULL, 1, history, actions[1], NULL, NULL);
    policy_value_rows(blind, NULL, &one, critic, &values[0]);
    policy_value_rows(seeing, NULL, &one, critic, &values[1]);
    for (int i = 0; i < 2; i++) {
        expect_near("action", (double)actions[1][i], (double)actions[0][i], 1e-6);
    }
    expect_near("value", (double)values[1], (double)values[0], 1e-6);
    expect_near("noise", (double)policy_std(seeing)[1], 0.3, 1e-6);
    assert_true(policy_take_networks(again, seeing)); /* of one shape */
    assert_memory_equal(policy_parameters(again), policy_parameters(seeing),
                        (size_t)policy_parameter_count(again) * sizeof(float));
    policy_destroy(again);
    assert_int_equal(policy_save(seeing, PATH, "", NULL), MILD_OK); /* a file has it */
    again = policy_load(PATH, NULL, 0, NULL);
    assert_true(again && policy_def(again)->scan == SCAN);
    policy_act(again, NULL, 1, history, actions[0], NULL, NULL);
    assert_memory_equal(actions[0], actions[1], sizeof actions[0]);
    unlink(PATH);
    policy_destroy(again);
    policy_destroy(seeing);
    policy_destroy(blind);
}

/* A file whose weights see the clock that it denies is refused. */
TEST(test_clock_that_is_denied) {
    static const int places[][2] = {{0, 3}, {0, 14}, {5, 8}}; /* row, column of the encoder */
    MildError error = {0};
    for (int k = 0; k < 4; k++) {
        Policy *policy = clock_policy(POLICY_INPUT_FEET, 0);
        const Network *n = &policy->network;
        const int64_t place = k < 3 ? n->encoder.layer[0].weight + places[k][0] * 15 + places[k][1]
                                    : n->actor.layer[0].weight + 7 * n->actor_input + 4;
        policy->parameters[place] = 1e-3f;
        assert_int_equal(policy_save(policy, PATH, "", &error), MILD_OK);
        assert_null(policy_load(PATH, NULL, 0, &error));
        assert_error(&error, MILD_ERROR_FORMAT, PATH " policy.actor_phase");
        policy_destroy(policy);
    }
    unlink(PATH);
}

/* The spread of a new policy's weights is 1/sqrt(inputs), in each network's last layer less. */
TEST(test_initial_spread) {
    static const double last_scale[NETWORK_MLPS] = {0.5, 1.0, 0.0, 0.02, 1.0};
    PolicyDef def = policy_def_default();
    def.critic_input = 98;
    Policy *policy = policy_create(&def, 21, NULL);
    assert_non_null(policy);
    for (int n = 0; n < NETWORK_MLPS; n++) {
        const char *name;
        const Mlp *mlp = network_mlp(&policy->network, n, &name);
        for (int l = 0; l < mlp->layers; l++) {
            const MlpLayer *layer = &mlp->layer[l];
            const int64_t count = layer->bias - layer->weight;
            const double scale = l + 1 < mlp->layers ? 1.0 : last_scale[n];
            double squares = 0.0;
            for (int64_t i = layer->weight; i < layer->bias; i++) {
                squares += pow((double)policy->parameters[i], 2) * layer->in / (double)count;
            }
            /* four deviations of a mean of squares */
            assert_true(fabs(squares - scale * scale) <=
                        4.0 * sqrt(2.0 / (double)count) * scale * scale);
        }
    }
    policy_destroy(policy);
}

/* theta1 = 1, theta2 = 0 at the start: the modulated latent is the encoder's mu. */
TEST(test_modulation_starts_at_identity) {
    for (int per_dimension = 0; per_dimension < 2; per_dimension++) {
        MildError error = {0};
        PolicyDef def = small_def();
        def.modulation_per_dimension = per_dimension;
        Policy *policy = policy_create(&def, 8, &error);
        float history[15], actions[2], latent[4], mu[4], theta[8];
        const PolicyInside inside = {.latent = mu, .theta = theta};
        const int thetas = per_dimension ? 4 : 1; /* theta1, and as many theta2 */
        Random random = random_at(6, 0, 0);
        fill_normal(history, 15, 1.0, &random);
        policy_act(policy, NULL, 1, history, actions, NULL, latent);
        policy_act_inside(policy, NULL, 1, history, NULL, actions, &inside);
        assert_memory_equal(latent, mu, sizeof latent);
        assert_true(mu[0] != 0 && mu[3] != 0);
        assert_int_equal(policy_theta(policy), 2 * thetas);
        for (int i = 0; i < 2 * thetas; i++) {
            assert_true(theta[i] == (i < thetas ? 1 : 0));
        }
        policy_destroy(policy);
    }
}

/* Networks of every kind are read as they were written, with the note. Keys that came later are in
 * the file only where they are not as they always were. */
TEST(test_round_trip) {
    enum { GROUND = 1, FRAME = 2, INPUT = 4, CLOCK = 8 }; /* keys that are written */
    static const char *const keys[] = {"policy.ground_count", "policy.decoder_frame",
                                       "policy.modulation_input", "policy.actor_phase"};
    static const struct {
        int frame, ground_offset, ground_count, input, sees, decoded, keys;
    } rows[] = {
        {1, 0, 0, POLICY_INPUT_FEET, 1, 5, 0},
        {0, 4, 1, POLICY_INPUT_FEET, 1, 1, GROUND | FRAME},
        {1, 4, 2, POLICY_INPUT_FEET, 1, 7, GROUND | FRAME},
        {1, 0, 0, POLICY_INPUT_FEET, 0, 5, CLOCK},
        {1, 0, 0, POLICY_INPUT_FEET_PHASE, 1, 5, INPUT},
        {1, 0, 0, POLICY_INPUT_FEET_PHASE, 0, 5, INPUT | CLOCK},
    };
    const char *note = "say \"crc32\":\"00000000\", tab\t, \xc3\xa9";
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        MildError error = {0};
        PolicyDef def = small_def();
        char back[64];
        strcpy(def.robot, "quadruped");
        def.decoder_frame = rows[i].frame;
        def.ground_offset = rows[i].ground_offset;
        def.ground_count = rows[i].ground_count;
        def.modulation_input = rows[i].input;
        def.actor_phase = rows[i].sees;
        Policy *policy = policy_create(&def, 4, &error);
        expect_good(policy != NULL, &error);
        assert_int_equal(policy->network.decoded, rows[i].decoded);
        assert_int_equal(policy_save(policy, PATH, note, &error), MILD_OK);
        assert_int_equal(temporary_files(), 0);
        Safetensors *file = safetensors_read(PATH, &error);
        assert_non_null(file);
        for (int k = 0; k < 4; k++) {
            assert_int_equal(safetensors_text(file, keys[k]) != NULL, rows[i].keys >> k & 1);
        }
        safetensors_destroy(file);
        Policy *loaded = policy_load(PATH, back, sizeof back, &error);
        assert_non_null(loaded);
        assert_string_equal(back, note);
        assert_memory_equal(policy_def(loaded), policy_def(policy), sizeof def);
        assert_memory_equal(policy_parameters(loaded), policy_parameters(policy),
                            parameter_bytes(policy));
        assert_int_equal(change_clock(loaded, NULL).latent, rows[i].sees);
        policy_destroy(loaded);
        policy_destroy(policy);
        unlink(PATH);
    }
}

static void check_bad_file(const char *path, MildStatus status) {
    MildError error = {0};
    Policy *policy = policy_load(path, NULL, 0, &error);
    assert_null(policy);
    assert_error(&error, status, path);
}

TEST(test_damaged_files) {
    MildError error = {0};
    Policy *policy = small_policy(4);
    assert_int_equal(policy_save(policy, PATH, "damage", &error), MILD_OK);
    size_t size;
    unsigned char *bytes = (unsigned char *)kit_read(PATH, &size);
    for (size_t cut = 0; cut < 50; cut++) {
        kit_write(PATH, bytes, size * cut / 50);
        check_bad_file(PATH, MILD_ERROR_FORMAT);
    }
    kit_write(PATH, bytes, size - 1);
    check_bad_file(PATH, MILD_ERROR_FORMAT);
    Random random = random_at(12, 0, 0);
    for (int flip = 0; flip < 600; flip++) { /* every bit of the first bytes, then anywhere */
        size_t at = flip < 200 ? (size_t)flip / 8 : random_index(&random, (uint32_t)size);
        unsigned char mask = (unsigned char)(1u << (flip % 8));
        bytes[at] ^= mask;
        kit_write(PATH, bytes, size);
        check_bad_file(PATH, MILD_ERROR_FORMAT);
        bytes[at] ^= mask;
    }
    unlink(PATH);
    check_bad_file(PATH, MILD_ERROR_IO);
    check_bad_file("/", MILD_ERROR_IO);
    check_bad_file("no/such/folder/policy.safetensors", MILD_ERROR_IO);
    free(bytes);
    policy_destroy(policy);
}

/* Files with a right checksum whose header lies. */
TEST(test_lying_headers) {
    static const char *const swaps[][2] = {
        {"\"shape\":[12,15]", "\"shape\":[15,12]"},
        {"\"shape\":[12,15]", "\"shape\":[12,16]"},
        {"\"shape\":[12,15]", "\"shape\":[1e99]"},
        {"\"shape\":[12,15]", "\"shape\":[-1,1]"},
        {"[0,720]", "[4,724]"},
        {"[0,720]", "[0,719]"},
        {"[0,720]", "[720,0]"},
        {"[0,720]", "[0,1e9]"},
        {"\"F32\"", "\"F16\""},
        {"\"F32\"", "\"F64\""},
        {"\"F32\"", "\"X32\""},
        {"\"policy.latent\":\"4\"", "\"policy.latent\":\"5\""},
        {"\"policy.latent\":\"4\"", "\"policy.latent\":\"x\""},
        {"\"policy.latent\"", "\"policy.latenz\""},
        {"\"policy.frames\":\"3\"", "\"policy.frames\":\"0\""},
        {"\"12 8 0 0\"", "\"12 0 8 0\""},
        {"\"12 8 0 0\"", "\"8192 0 \""},
        {"\"kind\":\"mild policy\"", "\"kind\":\"wild policy\""},
        {"\"version\":\"1\"", "\"version\":\"2\""},
        {"\"log_std\"", "\"log_sdt\""},
        {"\"encoder.2.bias\"", "\"encoder.0.bias\""},
        {"{\"__metadata__\":{", "{\"__metadata__\":["},
        {"\"note\":\"lies\"", "\"note\":123456"},
        {"\"policy.feet_velocity_count\":\"3\"", "\"policy.feet_velocity_count\":\"7\""},
    };
    MildError error = {0};
    Policy *policy = small_policy(4);
    assert_int_equal(policy_save(policy, PATH, "lies", &error), MILD_OK);
    size_t size;
    unsigned char *bytes = (unsigned char *)kit_read(PATH, &size), *lie = malloc(size);
    assert_non_null(lie);
    for (size_t i = 0; i < sizeof swaps / sizeof *swaps; i++) {
        memcpy(lie, bytes, size);
        const char *from = swaps[i][0], *to = swaps[i][1];
        size_t length = strlen(from), at = 8;
        while (at + length < size && memcmp(lie + at, from, length) != 0) {
            at++;
        }
        assert_true(at + length < size);
        size_t kept = strlen(to) < length ? strlen(to) : length;
        memset(lie + at, ' ', length);
        memcpy(lie + at, to, kept);
        assert_true(safetensors_seal(lie, size));
        kit_write(PATH, lie, size);
        check_bad_file(PATH, MILD_ERROR_FORMAT);
    }
    memcpy(lie, bytes, size);
    const float bad = NAN;
    memcpy(lie + size - sizeof bad, &bad, sizeof bad);
    assert_true(safetensors_seal(lie, size));
    kit_write(PATH, lie, size);
    check_bad_file(PATH, MILD_ERROR_FORMAT);
    free(lie);
    free(bytes);
    unlink(PATH);
    policy_destroy(policy);
}

/* Behind the header's last brace there are blanks only. */
TEST(test_padding_is_blank) {
    int padded = 0;
    for (int n = 1; n <= 8; n++) { /* notes of any length modulo 8: some leave padding */
        MildError error = {0};
        Policy *policy = small_policy(4);
        assert_int_equal(policy_save(policy, PATH, &"12345678"[8 - n], &error), MILD_OK);
        policy_destroy(policy);
        size_t size;
        unsigned char *bytes = (unsigned char *)kit_read(PATH, &size);
        const size_t end = 8 + bytes[0] + 256u * bytes[1] + 65536u * bytes[2];
        if (bytes[end - 1] == ' ') {
            padded++;
            bytes[end - 1] = '}';
            assert_true(safetensors_seal(bytes, size));
            kit_write(PATH, bytes, size);
            check_bad_file(PATH, MILD_ERROR_FORMAT);
        }
        free(bytes);
        unlink(PATH);
    }
    assert_true(padded > 0);
}

/* A header that is no JSON is called unreadable; memory is another matter. */
TEST(test_unreadable_header) {
    MildError error = {0};
    Policy *policy = small_policy(4);
    assert_int_equal(policy_save(policy, PATH, NULL, &error), MILD_OK);
    policy_destroy(policy);
    size_t size;
    unsigned char *bytes = (unsigned char *)kit_read(PATH, &size);
    bytes[9] = 'x'; /* in the place of a quote */
    assert_true(safetensors_seal(bytes, size));
    kit_write(PATH, bytes, size);
    errno = ENOMEM; /* of something before */
    assert_null(policy_load(PATH, NULL, 0, &error));
    assert_error(&error, MILD_ERROR_FORMAT, PATH " header");
    free(bytes);
    unlink(PATH);
}

/* Every number that half precision has, by the definition of binary16, between tensors that stay as
 * they are. */
TEST(test_half_precision) {
    enum { COUNT = 1 << 16 };
    static uint16_t half[COUNT];
    const float before[3] = {1, 2, 3};
    const double after = 0.1;
    for (int i = 0; i < COUNT; i++) {
        half[i] = (uint16_t)i;
    }
    const Safetensor tensors[] = {{"before", SAFETENSORS_F32, 1, {3}, before, 0},
                                  {"half", SAFETENSORS_F16, 2, {256, 256}, half, 0},
                                  {"after", SAFETENSORS_F64, 1, {1}, &after, 0}};
    MildError error = {0};
    assert_int_equal(safetensors_write(PATH, tensors, 3, NULL, 0, &error), MILD_OK);
    Safetensors *file = safetensors_read(PATH, &error);
    assert_non_null(file);
    const Safetensor *wide = safetensors_find(file, "half");
    assert_int_equal(wide->type, SAFETENSORS_F32);
    assert_int_equal(wide->bytes, COUNT * sizeof(float));
    assert_true(wide->rank == 2 && wide->shape[0] == 256 && wide->shape[1] == 256);
    for (int i = 0; i < COUNT; i++) {
        float number;
        memcpy(&number, (const char *)wide->data + (size_t)i * sizeof number, sizeof number);
        const int exponent = i / 1024 % 32, fraction = i % 1024;
        double wanted = pow(2, exponent - 15) * (1 + fraction / 1024.0);
        wanted = exponent == 0 ? pow(2, -14) * fraction / 1024 : wanted;
        wanted = exponent == 31 ? (double)INFINITY : wanted;
        assert_int_equal(signbit(number) != 0, i >= COUNT / 2);
        assert_true(exponent == 31 && fraction ? isnan(number) : fabs((double)number) == wanted);
    }
    assert_memory_equal(safetensors_find(file, "before")->data, before, sizeof before);
    assert_memory_equal(safetensors_find(file, "after")->data, &after, sizeof after);
    safetensors_destroy(file);
    unlink(PATH);
}

/* Files of other programs may have more tensors than ours; 2000 are refused in words. */
TEST(test_a_thousand_tensors) {
    enum { COUNT = 1000 };
    static char names[2 * COUNT][8];
    static Safetensor tensors[2 * COUNT];
    const float number = 0.5f;
    MildError error = {0};
    for (int i = 0; i < 2 * COUNT; i++) {
        snprintf(names[i], sizeof names[i], "t%d", i);
        tensors[i] = (Safetensor){names[i], SAFETENSORS_F32, 1, {1}, &number, 0};
    }
    assert_int_equal(safetensors_write(PATH, tensors, COUNT, NULL, 0, &error), MILD_OK);
    Safetensors *file = safetensors_read(PATH, &error);
    assert_non_null(file);
    assert_int_equal(safetensors_count(file), COUNT);
    assert_memory_equal(safetensors_find(file, "t999")->data, &number, sizeof number);
    safetensors_destroy(file);
    assert_int_equal(safetensors_write(PATH, tensors, 2 * COUNT, NULL, 0, &error), MILD_OK);
    assert_null(safetensors_read(PATH, &error));
    assert_error(&error, MILD_ERROR_FORMAT, PATH " header");
    unlink(PATH);
}

/* A disk that fills up half way: the old file stays, no temporary one is left. */
TEST(test_full_disk) {
    MildError error = {0};
    Policy *old = small_policy(1), *fresh = small_policy(2);
    assert_int_equal(policy_save(old, PATH, "old", &error), MILD_OK);
    struct rlimit before, tight;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    tight = before;
    tight.rlim_cur = 2000;
    void (*handler)(int) = signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &tight), 0);
    MildStatus status = policy_save(fresh, PATH, "new", &error);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    signal(SIGXFSZ, handler);
    assert_int_equal(status, MILD_ERROR_IO);
    assert_error(&error, MILD_ERROR_IO, PATH);
    assert_int_equal(temporary_files(), 0);
    char note[8];
    Policy *kept = policy_load(PATH, note, sizeof note, &error);
    assert_non_null(kept);
    assert_string_equal(note, "old");
    assert_int_equal(policy_save(fresh, "no/such/folder/policy.safetensors", "", &error),
                     MILD_ERROR_IO);
    unlink(PATH);
    assert_int_equal(mkdir(PATH, 0700), 0); /* a folder of that name is not replaced either */
    assert_int_equal(policy_save(fresh, PATH, "new", &error), MILD_ERROR_IO);
    assert_int_equal(access(PATH ".tmp", F_OK), -1);
    assert_int_equal(rmdir(PATH), 0);
    policy_destroy(kept);
    policy_destroy(old);
    policy_destroy(fresh);
}

TEST(test_unusable_defs) {
    static const struct {
        size_t field;
        int value;
        const char *names;
    } rows[] = {
        {offsetof(PolicyDef, observation), 0, "policy.observation 0"},
        {offsetof(PolicyDef, observation), 16385, "policy.observation 16385"},
        {offsetof(PolicyDef, frames), -1, "policy.frames -1"},
        {offsetof(PolicyDef, frames), 16384, "16384 frames 5 numbers"},
        {offsetof(PolicyDef, critic_input), 0, "policy.critic_input 0"},
        {offsetof(PolicyDef, estimates), 0, "policy.estimates 0"},
        {offsetof(PolicyDef, actions), 0, "policy.actions 0"},
        {offsetof(PolicyDef, actions), NETWORK_ACTIONS_MAX + 1, "policy.actions 65"},
        {offsetof(PolicyDef, encoder_hidden), 0, "policy.encoder_hidden 8 layer 2"},
        {offsetof(PolicyDef, feet_velocity_count), 6, "policy"},
    };
    MildError error = {0};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        PolicyDef def = small_def();
        memcpy((char *)&def + rows[i].field, &rows[i].value, sizeof rows[i].value);
        assert_null(policy_create(&def, 1, &error));
        assert_error(&error, MILD_ERROR_RANGE, rows[i].names);
    }
    PolicyDef def = small_def();
    def.init_std = NAN;
    assert_null(policy_create(&def, 1, &error));
    for (int k = 0; k < 2; k++) {
        def = small_def();
        def.observation = 1;
        def.modulation_input = k ? POLICY_INPUT_FEET_PHASE : POLICY_INPUT_FEET;
        def.actor_phase = k;
        assert_null(policy_create(&def, 1, &error));
        assert_error(&error, MILD_ERROR_RANGE, "clock actor_phase feet_phase");
    }
    static const int grounds[][3] = {{0, 8, 1}, {4, 4, 1}, {-1, 2, 1}, {3, -1, 1}, {3, 0, 0}};
    for (size_t i = 0; i < sizeof grounds / sizeof *grounds; i++) { /* of 7 numbers */
        def = small_def();
        def.ground_offset = grounds[i][0];
        def.ground_count = grounds[i][1];
        def.decoder_frame = grounds[i][2];
        assert_null(policy_create(&def, 1, &error));
        assert_error(&error, MILD_ERROR_RANGE, "policy decoder 7");
    }
}

TEST_MAIN(NULL, NULL)
