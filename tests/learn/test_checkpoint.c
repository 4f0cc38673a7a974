/* Checkpoints and policies that were changed by hand, each with a good checksum: what does not fit
 * or makes no sense is refused, named, and changes nothing. And what an update leaves behind in
 * memory is of no effect on the next. */
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "learn/ppo_private.h"
#include "learn/safetensors.h"
#include "toy.h"

#define PATH "build_test_checkpoint.safetensors"

static void run_open(ToyRun *run, PolicyDef policy_def, PpoDef def) {
    toy_run_open(run, 1, 4, policy_def, def);
}

static void run_open_toy(ToyRun *run) {
    run_open(run, toy_policy_def(), toy_ppo_def());
}

static void save(const ToyRun *run) {
    MildError error = {0};
    assert_int_equal(ppo_save(run->ppo, PATH, NULL, 0, "toy", &error), MILD_OK);
}

static void check_bad_checkpoint(ToyRun *run, MildStatus status, const char *names) {
    MildError error = {0};
    const size_t bytes = (size_t)policy_parameter_count(run->policy) * sizeof(float);
    float *before = malloc(bytes);
    assert_non_null(before);
    memcpy(before, policy_parameters(run->policy), bytes);
    const int64_t iteration = ppo_iteration(run->ppo);
    const MildStatus got = ppo_load(run->ppo, PATH, NULL, 0, &error);
    assert_true(kit_named(error.text, PATH));
    assert_refused(got, status, &error, names);
    assert_memory_equal(before, policy_parameters(run->policy), bytes);
    assert_int_equal(ppo_iteration(run->ppo), iteration);
    free(before);
}

/* Puts `to` in place of `from` in the file's header and the right checksum into it. Not longer. */
static void swap_text(const char *from, const char *to) {
    static unsigned char bytes[1 << 20];
    FILE *file = fopen(PATH, "r+b");
    assert_non_null(file);
    const size_t size = fread(bytes, 1, sizeof bytes, file), length = strlen(from);
    size_t at = 8;
    while (at + length < size && memcmp(bytes + at, from, length) != 0) {
        at++;
    }
    assert_true(at + length < size && strlen(to) <= length);
    memset(bytes + at, ' ', length);
    memcpy(bytes + at, to, strlen(to));
    assert_true(safetensors_seal(bytes, size));
    rewind(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

/* Numbers that would spoil the run at its first update. */
TEST(bad_numbers_are_refused) {
    PolicyDef policy_def = toy_policy_def();
    PpoDef def = toy_ppo_def();
    def.average = 0.9;
    ToyRun run, other;
    run_open(&run, policy_def, def);
    run_open(&other, policy_def, def);
    toy_run_iterate(&run, 1);
    float *const weights[] = {run.ppo->first + 3, run.ppo->second + 4,
                              policy_parameters(run.ppo->average) + 5,
                              policy_parameters(run.policy) + 6};
    static const char *const names[] = {"train.first_moment", "train.second_moment",
                                        "train.average", "weights"};
    for (int k = 0; k < 4; k++) {
        const float good = *weights[k];
        *weights[k] = k % 2 ? NAN : INFINITY;
        save(&run);
        check_bad_checkpoint(&other, MILD_ERROR_FORMAT, names[k]);
        *weights[k] = good;
    }
    const char *const senseless = "counters";
    static const double rates[] = {-1e-9, 1.0001, NAN};
    const double rate = run.ppo->learning_rate;
    for (int k = 0; k < 3; k++) {
        run.ppo->learning_rate = rates[k];
        save(&run);
        check_bad_checkpoint(&other, MILD_ERROR_FORMAT, senseless);
    }
    run.ppo->learning_rate = rate;
    int64_t *const counters[] = {&run.ppo->iteration, &run.ppo->adam_steps};
    for (int k = 0; k < 2; k++) {
        const int64_t good = *counters[k];
        *counters[k] = -1;
        save(&run);
        check_bad_checkpoint(&other, MILD_ERROR_FORMAT, senseless);
        *counters[k] = good;
    }
    MildError error = {0};
    save(&run);
    assert_int_equal(ppo_load(other.ppo, PATH, NULL, 0, &error), MILD_OK);
    unlink(PATH);
    toy_run_close(&run);
    toy_run_close(&other);
}

/* A network of another shape, or of other environments, is refused with both sizes; another first
 * noise is none. A policy alone is no checkpoint. */
TEST(another_network_is_refused) {
    MildError error = {0};
    PolicyDef wider = toy_policy_def(), louder = toy_policy_def();
    PpoDef def = toy_ppo_def();
    wider.actor_hidden[1] = 33;
    louder.init_std *= 0.5;
    ToyRun run, other, more, same;
    run_open_toy(&run);
    run_open(&other, wider, def);
    toy_run_open(&more, 1, 8, toy_policy_def(), def);
    run_open(&same, louder, def);
    save(&run);
    check_bad_checkpoint(&other, MILD_ERROR_ARGUMENT, "policy.actor_hidden 32 33");
    check_bad_checkpoint(&more, MILD_ERROR_ARGUMENT, "train.history 192 384");
    assert_int_equal(ppo_load(same.ppo, PATH, NULL, 0, &error), MILD_OK);
    assert_memory_equal(policy_parameters(run.policy), policy_parameters(same.policy),
                        (size_t)policy_parameter_count(run.policy) * sizeof(float));
    assert_int_equal(policy_save(run.policy, PATH, "", &error), MILD_OK);
    check_bad_checkpoint(&run, MILD_ERROR_ARGUMENT, "kind policy checkpoint");
    unlink(PATH);
    check_bad_checkpoint(&run, MILD_ERROR_IO, PATH);
    toy_run_close(&run);
    toy_run_close(&other);
    toy_run_close(&more);
    toy_run_close(&same);
}

/* The moments of one optimiser are none to the other. */
TEST(another_optimizer_is_refused) {
    MildError error = {0};
    PolicyDef policy_def = toy_policy_def();
    PpoDef def = toy_ppo_def();
    ToyRun adam, muon, again;
    run_open_toy(&adam);
    def.optimizer = PPO_OPTIMIZER_MUON;
    run_open(&muon, policy_def, def);
    run_open(&again, policy_def, def);
    toy_run_iterate(&muon, 1);
    save(&adam);
    check_bad_checkpoint(&muon, MILD_ERROR_ARGUMENT, "ppo.optimizer adam muon");
    save(&muon);
    check_bad_checkpoint(&adam, MILD_ERROR_ARGUMENT, "ppo.optimizer muon adam");
    assert_int_equal(ppo_load(again.ppo, PATH, NULL, 0, &error), MILD_OK);
    unlink(PATH);
    toy_run_close(&adam);
    toy_run_close(&muon);
    toy_run_close(&again);
}

/* What resuming needs must be there, of its size, under its name. */
TEST(missing_parts_are_refused) {
    static const char *const parts[] = {
        "train.counters", "train.learning_rate", "train.first_moment", "train.second_moment",
        "train.history",  "train.critic",        "train.target",       "train.frame",
    };
    ToyRun run;
    run_open_toy(&run);
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) {
        char from[64], to[64];
        snprintf(from, sizeof from, "\"%s\"", parts[k]);
        snprintf(to, sizeof to, "\"train.X%s", from + 8);
        save(&run);
        swap_text(from, to);
        check_bad_checkpoint(&run, MILD_ERROR_ARGUMENT, parts[k]);
    }
    save(&run);
    swap_text("\"log_std\"", "\"log_sdt\"");
    check_bad_checkpoint(&run, MILD_ERROR_FORMAT, "log_std");
    save(&run);
    swap_text("\"kind\":\"mild checkpoint\"", "\"kind\":\"wild checkpoint\"");
    check_bad_checkpoint(&run, MILD_ERROR_FORMAT, "policy");
    save(&run);
    swap_text("\"version\":\"1\"", "\"version\":\"2\"");
    check_bad_checkpoint(&run, MILD_ERROR_FORMAT, "version 2 1");
    save(&run);
    swap_text("\"policy.actions\":\"2\"", "\"policy.actions\":\"0\"");
    check_bad_checkpoint(&run, MILD_ERROR_FORMAT, "policy.actions 0 1 64");
    unlink(PATH);
    toy_run_close(&run);
}

/* A run without averages goes on as one with averages, which start from its weights, and back. */
TEST(averages_come_and_go) {
    MildError error = {0};
    PolicyDef policy_def = toy_policy_def();
    PpoDef def = toy_ppo_def();
    ToyRun plain, averaged, again;
    run_open(&plain, policy_def, def);
    def.average = 0.9;
    run_open(&averaged, policy_def, def);
    run_open(&again, policy_def, def);
    const size_t bytes = (size_t)policy_parameter_count(plain.policy) * sizeof(float);
    assert_int_equal(ppo_bytes(averaged.ppo) - ppo_bytes(plain.ppo), bytes);
    assert_true(ppo_bytes(plain.ppo) > (8 + 2) * bytes); /* gradients and two moments */
    toy_run_iterate(&plain, 1);
    toy_run_iterate(&averaged, 1);
    save(&plain);
    assert_int_equal(ppo_load(averaged.ppo, PATH, NULL, 0, &error), MILD_OK);
    assert_memory_equal(policy_parameters(plain.policy),
                        policy_parameters(ppo_average(averaged.ppo)), bytes);
    toy_run_iterate(&averaged, 1);
    save(&averaged);
    assert_int_equal(ppo_load(again.ppo, PATH, NULL, 0, &error), MILD_OK);
    assert_memory_equal(policy_parameters(ppo_average(averaged.ppo)),
                        policy_parameters(ppo_average(again.ppo)), bytes);
    assert_memory_not_equal(policy_parameters(again.policy),
                            policy_parameters(ppo_average(again.ppo)), bytes);
    assert_int_equal(ppo_load(plain.ppo, PATH, NULL, 0, &error), MILD_OK);
    assert_memory_equal(policy_parameters(averaged.policy), policy_parameters(plain.policy), bytes);
    unlink(PATH);
    toy_run_close(&plain);
    toy_run_close(&averaged);
    toy_run_close(&again);
}

/* With more minibatches than samples in a stratum most shards are empty: what the minibatch before
 * left in them must not count. A run that resumed here has nothing left there. */
TEST(empty_shards_are_empty) {
    MildError error = {0};
    ToyRun run, fresh;
    PolicyDef policy_def = toy_policy_def();
    PpoDef def = toy_ppo_def();
    def.minibatches = 7; /* the first of them has no sample of 5 steps */
    def.steps = 5;
    run_open(&run, policy_def, def);
    run_open(&fresh, policy_def, def);
    toy_run_iterate(&run, 1);
    save(&run);
    assert_int_equal(ppo_load(fresh.ppo, PATH, NULL, 0, &error), MILD_OK);
    fresh.toy = run.toy;
    assert_int_equal(toy_run_iterate(&run, 1).skipped, 0);
    assert_int_equal(toy_run_iterate(&fresh, 1).skipped, 0);
    assert_memory_equal(policy_parameters(run.policy), policy_parameters(fresh.policy),
                        (size_t)policy_parameter_count(run.policy) * sizeof(float));
    unlink(PATH);
    toy_run_close(&run);
    toy_run_close(&fresh);
}

/* A note that has no room is cut, not left out; with no room at all nothing is written. */
TEST(notes_are_cut) {
    MildError error = {0};
    ToyRun run;
    run_open_toy(&run);
    save(&run);
    for (int size = 0; size <= 5; size++) {
        char note[8] = "????";
        Policy *policy = policy_load(PATH, note, size, &error);
        assert_non_null(policy);
        policy_destroy(policy);
        char wanted[8] = "toy";
        wanted[size > 0 ? size - 1 : 0] = '\0';
        assert_string_equal(note, size > 0 ? wanted : "????");
    }
    unlink(PATH);
    toy_run_close(&run);
}

/* Whole, of the learner alone, or none: who resumes would take new episodes for the saved ones. */
TEST(whole_checkpoints_are_told) {
    MildError error = {0};
    ToyRun run;
    int whole = 0;
    char kept[8] = {0};
    run_open_toy(&run);
    save(&run);
    assert_int_equal(ppo_file_is_whole(PATH, &whole, &error), MILD_OK);
    assert_true(whole);
    assert_int_equal(ppo_save_learner(run.ppo, PATH, kept, sizeof kept, "toy", &error), MILD_OK);
    assert_int_equal(ppo_file_is_whole(PATH, &whole, &error), MILD_OK);
    assert_false(whole);
    assert_int_equal(truncate(PATH, 40), 0);
    assert_refused(ppo_file_is_whole(PATH, &whole, &error), MILD_ERROR_FORMAT, &error, PATH);
    remove(PATH);
    assert_refused(ppo_file_is_whole(PATH, &whole, &error), MILD_ERROR_IO, &error, PATH);
    toy_run_close(&run);
}

TEST_MAIN(NULL, NULL)
