/* The learner as a whole, on the toy task. */
#include "toy.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "base/clock.h"
#include "learn/network.h"

static void run_open(ToyRun *run, int threads, int envs, PpoDef def) {
    toy_run_open(run, threads, envs, toy_policy_def(), def);
}

static void assert_same_parameters(ToyRun *a, ToyRun *b) {
    assert_int_equal(policy_parameter_count(a->policy), policy_parameter_count(b->policy));
    assert_memory_equal(policy_parameters(a->policy), policy_parameters(b->policy),
                        (size_t)policy_parameter_count(a->policy) * sizeof(float));
}

/* Shards, chunks and their order are fixed by the batch alone. 64 environments x 40 steps: several
 * chunks per shard. */
static void check_threads(PpoDef def) {
    ToyRun one;
    run_open(&one, 1, 64, def);
    PpoReport report = toy_run_iterate(&one, 2);
    for (int threads = 2; threads <= 3; threads++) {
        ToyRun more;
        run_open(&more, threads, 64, def);
        PpoReport other = toy_run_iterate(&more, 2);
        assert_same_parameters(&one, &more);
        assert_true(ppo_hash(more.ppo) == ppo_hash(one.ppo));
        assert_memory_equal(&report, &other, sizeof report);
        assert_memory_equal(&one.toy, &more.toy, sizeof one.toy);
        toy_run_close(&more);
    }
    const uint64_t hash = ppo_hash(one.ppo);
    toy_run_iterate(&one, 1);
    assert_true(ppo_hash(one.ppo) != hash);
    toy_run_close(&one);
}

TEST(test_threads_change_nothing) {
    PpoDef def = toy_ppo_def();
    check_threads(def);
    def.matmul = PPO_MATMUL_BF16;
    check_threads(def);
    def.optimizer = PPO_OPTIMIZER_MUON;
    check_threads(def);
}

static void check_resume(PpoDef def) {
    const char *path = "build_test_resume.safetensors";
    MildError error = {0};
    ToyRun whole, first, second;
    run_open(&whole, 2, 16, def);
    toy_run_iterate(&whole, 5);

    run_open(&first, 1, 16, def);
    toy_run_iterate(&first, 2);
    assert_int_equal(ppo_save(first.ppo, path, &first.toy, sizeof first.toy, "toy", &error),
                     MILD_OK);
    toy_run_close(&first);

    run_open(&second, 2, 16, def);
    toy_run_iterate(&second, 1); /* leaves traces that loading must wipe out */
    assert_int_equal(ppo_load(second.ppo, path, &second.toy, sizeof second.toy, &error), MILD_OK);
    assert_int_equal(ppo_iteration(second.ppo), 2);
    toy_run_iterate(&second, 3);
    assert_same_parameters(&whole, &second);
    assert_memory_equal(&whole.toy, &second.toy, sizeof whole.toy);

    /* another size of the caller's state is refused and changes nothing */
    assert_int_not_equal(ppo_load(second.ppo, path, &second.toy, sizeof second.toy - 1, &error),
                         MILD_OK);
    assert_int_not_equal(ppo_load(second.ppo, path, NULL, 0, &error), MILD_OK);
    assert_same_parameters(&whole, &second);

    /* a checkpoint is a policy too */
    char note[16];
    Policy *policy = policy_load(path, note, sizeof note, &error);
    assert_non_null(policy);
    assert_string_equal(note, "toy");
    policy_destroy(policy);
    unlink(path);
    toy_run_close(&second);
    toy_run_close(&whole);
}

TEST(test_resume_is_as_if_never_stopped) {
    PpoDef def = toy_ppo_def();
    check_resume(def);
    def.optimizer = PPO_OPTIMIZER_MUON;
    check_resume(def);
}

/* Samples marked invalid may hold anything: the result is the same. */
TEST(test_invalid_samples_have_no_weight) {
    ToyRun a, b;
    ToyRun *runs[2] = {&a, &b};
    const float junk[2] = {0.0f, NAN};
    PpoReport report[2];
    for (int k = 0; k < 2; k++) {
        run_open(runs[k], 1, 16, toy_ppo_def());
        toy_rollout(&runs[k]->toy, runs[k]->ppo);
        PpoBatch *batch = ppo_batch(runs[k]->ppo);
        for (int i = 50; i < 60; i++) {
            batch->valid[i] = 0;
            batch->reward[i] = batch->log_prob[i] = junk[k];
            batch->history[i * TOY_FRAMES * TOY_OBSERVATION] = junk[k];
            batch->action[2 * i] = batch->mean[2 * i] = batch->target[4 * i] =
                batch->frame[i * TOY_OBSERVATION] = junk[k];
        }
        ppo_update(runs[k]->ppo, &report[k]);
        assert_int_equal(report[k].skipped, 0);
    }
    assert_same_parameters(&a, &b);
    assert_memory_equal(&report[0], &report[1], sizeof *report);
    toy_run_close(&a);
    toy_run_close(&b);
}

/* Each target is the frame one step later, but an episode's last frame stands for itself. Without
 * noise the frames are those that the critic's input begins with. */
static void check_frames(int target, int noise) {
    enum { ENVS = 16, STEPS = 40, FLOATS = ENVS * TOY_OBSERVATION };
    ToyRun run;
    PpoDef def = toy_ppo_def();
    def.decoder_target = target;
    def.target_noise = noise;
    run_open(&run, 2, ENVS, def);
    toy_rollout(&run.toy, run.ppo);
    PpoBatch *b = ppo_batch(run.ppo);
    b->done[5 * ENVS + 3] = 1;
    b->valid[9 * ENVS + 7] = 0;
    for (int i = 0; i < (STEPS + 1) * FLOATS; i++) { /* a noise that cannot be missed */
        b->frame[i] += 1000.0f;
    }
    static float before[(STEPS + 1) * FLOATS], noiseless[(STEPS + 1) * FLOATS];
    memcpy(before, b->frame, sizeof before);
    memcpy(noiseless, b->critic, sizeof noiseless);
    const float *from =
        noise || target == PPO_TARGET_GROUND ? before : noiseless; /* the ground needs no frame */
    PpoReport report;
    ppo_update(run.ppo, &report);
    const int moves = target == PPO_TARGET_NEXT || target == PPO_TARGET_BOTH;
    int moved = 0;
    for (int i = ENVS; i < STEPS * ENVS; i++) { /* the update carried row 0 over */
        int stays = !moves || b->done[i] || i == 8 * ENVS + 7;
        const float *expected = from + (i + (stays ? 0 : ENVS)) * TOY_OBSERVATION;
        assert_memory_equal(b->frame + i * TOY_OBSERVATION, expected,
                            TOY_OBSERVATION * sizeof *expected);
        moved += !stays;
    }
    assert_true(moves ? moved > 500 : moved == 0);
    assert_memory_equal(b->frame, before + STEPS * FLOATS, FLOATS * sizeof *before);
    toy_run_close(&run);
}

TEST(test_frames_of_the_decoder) {
    for (int target = 0; target < PPO_TARGETS; target++) {
        check_frames(target, 1);
        check_frames(target, 0);
    }
}

/* The latent that an action was drawn with is the one of its probability in the update: before the
 * first step both policies are the same, so their divergence is rounding. Robots that see the same
 * have latents of their own, at every time. */
TEST(test_sampled_latent) {
    enum { ENVS = 16 };
    for (int sampled = 0; sampled < 2; sampled++) {
        ToyRun run;
        PpoDef def = toy_ppo_def();
        def.sample_latent = sampled;
        def.epochs = def.minibatches = 1;
        run_open(&run, 2, ENVS, def);
        Random random = random_at(3, 3, 3);
        float *p = policy_parameters(run.policy);
        for (int64_t i = 0; i < policy_parameter_count(run.policy) - 2; i++) { /* not log std */
            p[i] += (float)(0.1 * random_normal(&random));
        }
        PpoBatch *b = ppo_batch(run.ppo);
        const int width = TOY_FRAMES * TOY_OBSERVATION;
        toy_rollout(&run.toy, run.ppo);
        PpoReport report;
        ppo_update(run.ppo, &report);
        expect_near("kl of the first step", report.kl, 0, 1e-10);
        assert_true(report.clip_share == 0.0);
        int apart = 0;
        for (int i = 1; i < 2 * ENVS; i++) {
            memcpy(b->history + i * width, b->history, (size_t)width * sizeof(float));
        }
        ppo_act(run.ppo, 0);
        ppo_act(run.ppo, 1);
        for (int i = 0; i < 2 * ENVS; i++) {
            for (int k = 0; k < i; k++) {
                apart += fabsf(b->mean[2 * i] - b->mean[2 * k]) > 1e-6f;
            }
        }
        assert_int_equal(apart, sampled ? 2 * ENVS * (2 * ENVS - 1) / 2 : 0);
        toy_run_close(&run);
    }
}

/* A modulation that does not learn stays bit for bit where it started, while what is around it
 * learns; one that learns does not. */
TEST(test_modulation_that_does_not_learn) {
    for (int learns = 0; learns < 2; learns++) {
        for (int per_dimension = 0; per_dimension < 2; per_dimension++) {
            ToyRun run;
            PpoDef def = toy_ppo_def();
            def.modulation = learns;
            PolicyDef asked = toy_policy_def();
            asked.modulation_per_dimension = per_dimension;
            toy_run_open(&run, 2, 16, asked, def);
            Network n;
            assert_int_equal(network_layout(&n, policy_def(run.policy), NULL), MILD_OK);
            const int64_t first = n.modulation.layer[0].weight, last = n.actor.layer[0].weight;
            const float *p = policy_parameters(run.policy);
            const size_t bytes = (size_t)policy_parameter_count(run.policy) * sizeof *p;
            float *before = malloc(bytes);
            assert_non_null(before);
            memcpy(before, p, bytes);
            toy_run_iterate(&run, 3);
            assert_true(last > first);
            const int same =
                memcmp(p + first, before + first, (size_t)(last - first) * sizeof *p) == 0;
            assert_int_equal(same, !learns);
            assert_true(memcmp(p, before, (size_t)first * sizeof *p) != 0);
            free(before);
            toy_run_close(&run);
        }
    }
}

/* Bool: the weight of an input of a network's first layer is 0 in every row. */
static int is_blind(const Mlp *mlp, const float *parameters, int column) {
    const MlpLayer *layer = &mlp->layer[0];
    int blind = 1;
    for (int row = 0; row < layer->out; row++) {
        blind &= parameters[layer->weight + row * layer->in + column] == 0.0f;
    }
    return blind;
}

/* The weights of a clock that the actor does not see stay 0 while the others learn, whoever moves
 * them, and in the mean of the weights. */
TEST(test_clock_stays_unseen) {
    for (int optimizer = 0; optimizer < PPO_OPTIMIZERS; optimizer++) {
        ToyRun run;
        PpoDef def = toy_ppo_def();
        def.optimizer = optimizer;
        def.average = 0.5;
        PolicyDef asked = toy_policy_def();
        asked.modulation_input = POLICY_INPUT_FEET_PHASE;
        asked.actor_phase = 0;
        toy_run_open(&run, 2, 16, asked, def);
        Network n;
        assert_int_equal(network_layout(&n, policy_def(run.policy), NULL), MILD_OK);
        toy_run_iterate(&run, 3);
        const float *const both[] = {policy_parameters(run.policy),
                                     policy_parameters(ppo_average(run.ppo))};
        for (int k = 0; k < 2; k++) {
            for (int i = 0; i < n.history; i++) {
                assert_int_equal(is_blind(&n.encoder, both[k], i),
                                 i % TOY_OBSERVATION >= TOY_OBSERVATION - 2);
            }
            for (int i = 0; i < n.actor_input; i++) {
                assert_int_equal(is_blind(&n.actor, both[k], i),
                                 i == TOY_OBSERVATION - 2 || i == TOY_OBSERVATION - 1);
            }
            for (int i = 0; i < n.modulation.layer[0].in; i++) {
                assert_false(is_blind(&n.modulation, both[k], i));
            }
        }
        toy_run_close(&run);
    }
}

/* A decoder of another shape than its target needs. */
TEST(test_decoder_must_fit) {
    static const int ground[PPO_TARGETS] = {0, 0, 2, 2}, frame[PPO_TARGETS] = {1, 1, 0, 1};
    Pool *pool = pool_create(0);
    for (int target = 0; target < PPO_TARGETS; target++) {
        PolicyDef asked = toy_policy_def();
        PpoDef asks = toy_ppo_def();
        asks.decoder_target = target;
        ppo_set_decoder(&asks, 7, 2, &asked);
        assert_int_equal(asked.ground_count, ground[target]);
        assert_int_equal(asked.ground_offset, ground[target] ? 7 : 0);
        assert_int_equal(asked.decoder_frame, frame[target]);
        for (int shape = 0; shape < PPO_TARGETS; shape++) {
            MildError error = {0};
            PolicyDef policy_def = toy_policy_def();
            PpoDef def = toy_ppo_def();
            def.decoder_target = target;
            policy_def.decoder_frame = frame[shape];
            policy_def.ground_count = ground[shape];
            Policy *policy = policy_create(&policy_def, 5, &error);
            assert_non_null(policy);
            Ppo *ppo = ppo_create(&def, policy, pool, NULL, 4, 11, &error);
            const int fits = ground[shape] == ground[target] && frame[shape] == frame[target];
            assert_true(fits == (ppo != NULL));
            if (!fits) {
                assert_error(&error, MILD_ERROR_ARGUMENT, "ppo.decoder_target");
            }
            ppo_destroy(ppo);
            policy_destroy(policy);
        }
    }
    pool_destroy(pool);
}

/* Resting anywhere in [-1, 1] earns 0.44 /s on average; the goal, reached at once, about 0.93. What
 * was learned must stay: with returns ten times as large the critic could not follow, and the
 * policy fell back to 0.2 by iteration 60. */
static void check_toy(PpoDef def) {
    ToyRun run;
    run_open(&run, 1, 64, def);
    double begin = clock_seconds(), first = 0.0, reward = 0.0;
    PpoReport report = {0};
    int iteration = 0;
    for (; iteration < 120 && reward < 0.9; iteration++) {
        report = toy_run_iterate(&run, 1);
        reward = run.toy.reward;
        first = iteration == 0 ? reward : first;
        assert_int_equal(report.skipped, 0);
    }
    print_message("toy: reward %.3f -> %.3f in %d iterations, %.1f s; kl %.4f, rate %.1e, std "
                  "%.2f, explained %.2f, "
                  "estimates %.4f, "
                  "mirror %.4f\n",
                  first, reward, iteration, clock_seconds() - begin, report.kl,
                  report.learning_rate, report.action_std, report.explained_variance,
                  report.estimate_loss[0], report.mirror);
    assert_true(reward >= 0.9);
    double least = 1.0;
    const int more = kit_short() ? 6 : 60;
    for (int i = 0; i < more; i++) {
        toy_run_iterate(&run, 1);
        least = run.toy.reward < least ? run.toy.reward : least;
    }
    assert_true(least >= 0.88);
    toy_run_close(&run);
}

TEST(test_learns_the_toy_task) {
    check_toy(toy_ppo_def());
}

TEST(test_create_refuses) {
    MildError error = {0};
    const PolicyDef policy_def = toy_policy_def();
    const PpoDef plain = toy_ppo_def();
    PpoDef bad[4] = {plain, plain, plain, plain};
    Policy *policy = policy_create(&policy_def, 1, &error);
    Pool *pool = pool_create(1);
    bad[0].gamma = 1.5;
    bad[1].lambda = NAN;
    bad[2].learning_rate_min = 0.1;
    bad[3].shards = 12; /* sums would be no tree */
    for (int i = 0; i < 4; i++) {
        assert_null(ppo_create(&bad[i], policy, pool, NULL, 4, 1, &error));
    }
    assert_null(ppo_create(&plain, policy, pool, NULL, 0, 1, &error));
    const int index[TOY_OBSERVATION] = {0, 1, 2, 3, 4, 6};
    PpoMirror mirror = toy_mirror();
    mirror.observation_index = index;
    assert_null(ppo_create(&plain, policy, pool, &mirror, 4, 1, &error));
    policy_destroy(policy);
    pool_destroy(pool);
}

TEST_MAIN(NULL, NULL)
