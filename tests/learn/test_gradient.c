/* A minibatch's gradient: gathering, shards, chunks, images and noise, against the loss of one
 * sample at a time. */
#include "check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "learn/noise.h"
#include "learn/ppo.h"
#include "learn/ppo_gradient.h"
#include "learn/ppo_step.h"
#include "learn/product.h"

enum { STEPS = 70, ENVS = 50, SAMPLES = STEPS * ENVS };

typedef struct {
    Policy *policy;
    Pool *pool;
    Ppo *ppo;
    LossContext context;
    int samples[SAMPLES];
} Case;

static void case_open(Case *c, double mirror_share, int target) {
    MildError error = {0};
    PolicyDef policy_def = small_def();
    PpoDef def = ppo_def_default();
    const PpoMirror mirror = small_mirror();
    def.decoder_target = target;
    ppo_set_decoder(&def, 4, 2, &policy_def);
    def.steps = STEPS;
    def.kl_weight = 0.1;
    def.mirror_share = mirror_share;
    c->policy = policy_create(&policy_def, 2, &error);
    c->pool = pool_create(2);
    c->ppo = ppo_create(&def, c->policy, c->pool, &mirror, ENVS, 5, &error);
    assert_non_null(c->ppo);
    Random random = random_at(8, 0, 0);
    PpoBatch *b = ppo_batch(c->ppo);
    fill_normal(policy_parameters(c->policy), policy_parameter_count(c->policy), 0.3, &random);
    fill_normal(b->history, SAMPLES * 15, 1.0, &random);
    fill_normal(b->critic, SAMPLES * 7, 1.0, &random);
    fill_normal(b->target, SAMPLES * 6, 1.0, &random);
    fill_normal(b->frame, SAMPLES * 5, 1.0, &random);
    fill_normal(b->action, SAMPLES * 2, 1.0, &random);
    fill_normal(b->mean, SAMPLES * 2, 1.0, &random);
    fill_normal(b->value, SAMPLES, 1.0, &random);
    fill_normal(b->returns, SAMPLES, 1.0, &random);
    fill_normal(b->advantage, SAMPLES, 1.0, &random);
    fill_normal(b->log_prob, SAMPLES, 0.3, &random);
    for (int i = 0; i < SAMPLES; i++) {
        b->log_prob[i] -= 2.5f;
        c->samples[i] = (int)((int64_t)i * 1201 % SAMPLES); /* any order that is not the batch's */
    }
    c->context = (LossContext){.def = &c->ppo->def,
                               .network = &c->policy->network,
                               .mirror = &c->ppo->mirror,
                               .parameters = policy_parameters(c->policy),
                               .old_std = {0.9f, 1.1f}};
    memcpy(c->context.std, policy_std(c->policy), 2 * sizeof(float));
}

static void case_close(Case *c) {
    ppo_destroy(c->ppo);
    policy_destroy(c->policy);
    pool_destroy(c->pool);
}

enum { SHARDS = 8 }; /* of ppo_def_default */

/* Shards of unequal sizes, one of them empty. */
static PpoMinibatch minibatch_of(const int *samples, int count, uint32_t draw) {
    PpoMinibatch minibatch = {.samples = samples, .draw = draw};
    for (int s = 0; s <= PPO_SHARDS_MAX; s++) {
        const int cut = s < SHARDS ? s : SHARDS;
        minibatch.cut[s] = (int)((int64_t)count * cut * cut / (SHARDS * SHARDS));
    }
    minibatch.cut[4] = minibatch.cut[3];
    return minibatch;
}

/* The loss of sample p of the minibatch alone, added to gradient and sums. */
static void one_sample(const Case *c, LossChunk *chunk, int p, int image, const int *rows,
                       uint64_t key, float *gradient, LossSums *sums) {
    const PpoBatch *b = ppo_batch(c->ppo);
    const int i = c->samples[p];
    chunk->rows = 1;
    chunk->mirrored = image;
    memcpy(chunk->history, b->history + i * 15, 15 * sizeof(float));
    memcpy(chunk->estimate, b->target + i * 6, 6 * sizeof(float));
    const int frame = c->ppo->def.decoder_target == PPO_TARGET_GROUND ? 0 : 5;
    memcpy(chunk->decoder_target, b->frame + i * 5, (size_t)frame * sizeof(float));
    if (c->ppo->def.decoder_target > PPO_TARGET_NEXT) { /* numbers 4 and 5 of the critic's */
        memcpy(chunk->decoder_target + frame, b->critic + i * 7 + 4, 2 * sizeof(float));
    }
    memcpy(chunk->action, b->action + i * 2, 2 * sizeof(float));
    memcpy(chunk->old_mean, b->mean + i * 2, 2 * sizeof(float));
    memcpy(chunk->critic, b->critic + i * 7, 7 * sizeof(float));
    chunk->old_log_prob[0] = b->log_prob[i];
    chunk->advantage[0] = b->advantage[i];
    chunk->old_value[0] = b->value[i];
    chunk->returns[0] = b->returns[i];
    noise_normal(key, (int64_t)rows[p] * 4, 4, chunk->noise); /* four latents */
    if (image) {
        loss_mirror_row(&c->context, chunk, 0, 1);
    }
    loss_actor(&c->context, chunk, gradient, 1.0f, sums);
    loss_critic(&c->context, chunk, gradient, 1.0f, sums);
}

static double apart(double ours, double theirs) {
    return fabs(ours - theirs) / fmax(1.0, fabs(theirs));
}

static void check_minibatch(Case *c, int count, uint32_t draw, double share) {
    const int64_t parameters = policy_parameter_count(c->policy);
    int *which = malloc(SAMPLES * sizeof *which), *rows = malloc(SAMPLES * sizeof *rows);
    float *sum = calloc((size_t)parameters, sizeof *sum);
    LossChunk chunk;
    size_t floats = loss_carve(&c->policy->network, 1, 1, NULL, &chunk);
    float *block = aligned_alloc(64, (floats * sizeof(float) + 63) / 64 * 64);
    assert_true(which && rows && sum && block);
    loss_carve(&c->policy->network, 1, 1, block, &chunk);
    const PpoMinibatch minibatch = minibatch_of(c->samples, count, draw);
    const int images = ppo_mirrored(c->ppo, minibatch.cut, which);
    assert_int_equal(images, ppo_mirrored(c->ppo, minibatch.cut, NULL));
    assert_true(fabs(images - share * count) <= 8.0 * (1.0 + count / 2048.0));
    ppo_latent_rows(minibatch.cut, 0, rows);
    c->context.sample_weight = 1.0f / (float)count;
    c->context.mirror_weight = images ? 1.0f / (float)images : 0.0f;
    LossSums sums, expected = {0};
    double norm, squares = 0.0;
    memset(c->ppo->gradient, 0xff, SHARDS * c->ppo->stride * sizeof(float)); /* NaN */
    ppo_gradient(c->ppo, &c->context, &minibatch, &sums, &norm);
    int entered = product_enter(0);
    for (int p = 0, next = 0; p < count; p++) {
        int image = next < images && which[next] == p;
        next += image;
        one_sample(c, &chunk, p, image, rows,
                   step_latent_key(c->ppo->seed, c->ppo->iteration, draw), sum, &expected);
    }
    product_leave(entered);
    for (int64_t i = 0; i < parameters; i++) {
        expect_near("gradient", apart(c->ppo->gradient[i], sum[i]), 0, 2e-5);
        squares += (double)sum[i] * (double)sum[i];
    }
    const double ours[] = {sums.surrogate, sums.kl,          sums.clipped,     sums.reconstruction,
                           sums.vae_kl,    sums.estimate[0], sums.estimate[1], sums.estimate[2],
                           sums.mirror,    sums.value};
    const double theirs[] = {expected.surrogate,      expected.kl,          expected.clipped,
                             expected.reconstruction, expected.vae_kl,      expected.estimate[0],
                             expected.estimate[1],    expected.estimate[2], expected.mirror,
                             expected.value};
    for (size_t k = 0; k < sizeof ours / sizeof *ours; k++) {
        expect_entry("sum", (int)k, apart(ours[k], theirs[k]), 0, 1e-5);
        assert_true(theirs[k] != 0.0 || images == 0);
    }
    expect_near("norm", apart(norm, sqrt(squares)), 0, 1e-5);
    free(which);
    free(rows);
    free(sum);
    free(block);
}

/* Several chunks a shard; fewer samples than shards, where an empty shard must leave nothing. */
TEST(minibatch_is_the_sum_of_its_samples) {
    Case c;
    case_open(&c, 0.5, PPO_TARGET_NEXT);
    check_minibatch(&c, SAMPLES, 0, 0.5);
    check_minibatch(&c, 1001, 1, 0.5);
    check_minibatch(&c, 5, 2, 0.5);
    case_close(&c);
    case_open(&c, 1.0, PPO_TARGET_GROUND);
    check_minibatch(&c, 2100, 3, 1.0);
    case_close(&c);
    case_open(&c, 0.0, PPO_TARGET_BOTH);
    check_minibatch(&c, 300, 4, 0.0);
    case_close(&c);
}

/* No two samples of a minibatch share a latent's random numbers, and every other draw, iteration
 * and seed has its own. */
TEST(latents_are_drawn_apart) {
    static int row[8000], used[16000 + 512];
    static const int counts[] = {1, 7, 8, 100, 2048, 2049, 8000};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        memset(used, 0, sizeof used);
        ppo_latent_rows(minibatch_of(NULL, counts[i], 0).cut, 0, row);
        for (int p = 0; p < counts[i]; p++) {
            assert_true(row[p] >= 0 && row[p] < 2 * counts[i]);
            assert_int_equal(used[row[p]]++, 0);
        }
    }
    const uint64_t key = step_latent_key(5, 0, 0);
    assert_true(key == step_latent_key(5, 0, 0));
    assert_true(key != step_latent_key(5, 0, 1));
    assert_true(key != step_latent_key(5, 1, 0));
    assert_true(key != step_latent_key(6, 0, 0));
}

TEST_MAIN(NULL, NULL)
