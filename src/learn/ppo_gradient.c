#include "learn/ppo_gradient.h"

#include <math.h>
#include <string.h>

#include "learn/noise.h"
#include "learn/optimiser.h"
#include "learn/ppo_step.h"
#include "learn/product.h"

typedef struct {
    Ppo *ppo;
    const LossContext *loss;
    const PpoMinibatch *minibatch;
    LossSums sums[2 * PPO_SHARDS_MAX]; /* of all shards' halves: the actor's, then the critic's */
    double squares[PPO_RANGES];
} GradientJob;

static int chunk_mirrored(const Ppo *ppo, int rows) {
    return ppo->mirror.observation_index ? (int)(ppo->def.mirror_share * rows + 0.5) : 0;
}

int ppo_mirrored(const Ppo *ppo, const int *cut, int *which) {
    int total = 0;
    for (int s = 0; s < PPO_SHARDS_MAX; s++) {
        const int end = cut[s + 1];
        for (int at = cut[s]; at < end; at += PPO_CHUNK) {
            int images = chunk_mirrored(ppo, end - at < PPO_CHUNK ? end - at : PPO_CHUNK);
            for (int r = 0; which && r < images; r++) {
                which[total + r] = at + r;
            }
            total += images;
        }
    }
    return total;
}

/* A chunk that begins at sample `at` of the minibatch takes its numbers from 2 at latent onward
 * (gather_actor). */
void ppo_latent_rows(const int *cut, int first, int *row) {
    for (int s = 0; s < PPO_SHARDS_MAX; s++) {
        for (int p = cut[s]; p < cut[s + 1]; p++) {
            row[p] = 2 * first + p + cut[s] + (p - cut[s]) / PPO_CHUNK * PPO_CHUNK;
        }
    }
}

static void copy_row(float *to, int row, const float *from, int64_t sample, int width) {
    memcpy(to + (int64_t)row * width, from + sample * width, (size_t)width * sizeof *to);
}

/* [frame | ground] of sample i. */
static void copy_decoder_target(const Network *n, const PpoBatch *b, int64_t i, float *to) {
    const float *critic = b->critic + i * n->def.critic_input;
    memcpy(to, b->frame + i * n->def.observation, (size_t)n->decoded_frame * sizeof *to);
    memcpy(to + n->decoded_frame, critic + n->def.ground_offset,
           (size_t)n->def.ground_count * sizeof *to);
}

/* Samples from place `at` of the minibatch onward. */
static const int *samples_at(const GradientJob *job, int at) {
    return job->minibatch->samples + (at - job->minibatch->cut[job->ppo->part.shard]);
}

/* The noise of z in the rollout. An image has that of its sample. */
static void sampled_noise(const Ppo *ppo, const int *samples, LossChunk *chunk) {
    const int latent = ppo->policy->network.def.latent, envs = ppo->batch.envs;
    float *noise = chunk->noise;
    for (int r = 0; r < chunk->rows + chunk->mirrored; r++, noise += latent) {
        const int i = samples[r < chunk->rows ? r : r - chunk->rows],
                  env = ppo->part.first + i % envs;
        const uint64_t key = step_sampled_key(ppo->seed, ppo->iteration, i / envs);
        for (int j = 0; j < latent; j++) {
            noise[j] = noise_number(key, (int64_t)env * latent + j);
        }
    }
}

static void gather_actor(const GradientJob *job, int at, LossChunk *chunk) {
    const Ppo *ppo = job->ppo;
    const Network *n = &ppo->policy->network;
    const PpoBatch *b = &ppo->batch;
    const int *samples = samples_at(job, at);
    for (int r = 0; r < chunk->rows; r++) {
        int64_t i = samples[r];
        copy_row(chunk->history, r, b->history, i, n->history);
        copy_row(chunk->estimate, r, b->target, i, n->def.estimates);
        copy_decoder_target(n, b, i, chunk->decoder_target + (int64_t)r * n->decoded);
        copy_row(chunk->action, r, b->action, i, n->def.actions);
        copy_row(chunk->old_mean, r, b->mean, i, n->def.actions);
        chunk->old_log_prob[r] = b->log_prob[i];
        chunk->advantage[r] = b->advantage[i];
    }
    for (int r = 0; r < chunk->mirrored; r++) {
        loss_mirror_row(job->loss, chunk, r, chunk->rows + r);
    }
    chunk->outputs.noise = ppo->def.sample_latent ? chunk->noise : NULL;
    if (ppo->def.sample_latent) {
        sampled_noise(ppo, samples, chunk);
        return;
    }
    noise_normal(step_latent_key(ppo->seed, ppo->iteration, job->minibatch->draw),
                 2 * (int64_t)at * n->def.latent, chunk->rows * n->def.latent, chunk->noise);
}

static void gather_critic(const GradientJob *job, int at, LossChunk *chunk) {
    const PpoBatch *b = &job->ppo->batch;
    const int width = job->ppo->policy->network.def.critic_input;
    const int *samples = samples_at(job, at);
    for (int r = 0; r < chunk->rows; r++) {
        int64_t i = samples[r];
        copy_row(chunk->critic, r, b->critic, i, width);
        chunk->old_value[r] = b->value[i];
        chunk->returns[r] = b->returns[i];
    }
}

/* Clears an empty shard's half of the gradient, which still holds that of the last minibatch. */
static void clear_half(const Network *n, int critic, float *gradient) {
    if (critic) {
        memset(gradient + n->critic_first, 0,
               (size_t)(n->log_std - n->critic_first) * sizeof *gradient);
    } else {
        memset(gradient, 0, (size_t)n->critic_first * sizeof *gradient);
        memset(gradient + n->log_std, 0, (size_t)(n->count - n->log_std) * sizeof *gradient);
    }
}

/* The first pieces compute the actor's half of a shard each, which takes longer and so starts
 * first. The others compute the critic's half. */
static void gradient_piece(void *context, int piece, int thread) {
    GradientJob *job = context;
    Ppo *ppo = job->ppo;
    const Network *n = &ppo->policy->network;
    const int critic = piece >= ppo->part.shards, own = piece % ppo->part.shards;
    const int shard = ppo->part.shard + own;
    float *gradient = ppo->gradient + (size_t)own * ppo->stride;
    LossSums *sums = &job->sums[critic * ppo->part.all + shard];
    LossChunk chunk;
    loss_carve(n, PPO_CHUNK, ppo->mirror_rows, ppo->scratch + (size_t)thread * ppo->scratch_floats,
               &chunk);
    const int begin = job->minibatch->cut[shard], end = job->minibatch->cut[shard + 1];
    const int entered = product_enter(ppo->def.matmul == PPO_MATMUL_BF16);
    if (begin == end) {
        clear_half(n, critic, gradient);
    }
    for (int at = begin; at < end; at += PPO_CHUNK) {
        chunk.rows = end - at < PPO_CHUNK ? end - at : PPO_CHUNK;
        chunk.mirrored = chunk_mirrored(ppo, chunk.rows);
        float beta = at == begin ? 0.0f : 1.0f;
        if (critic) {
            gather_critic(job, at, &chunk);
            loss_critic(job->loss, &chunk, gradient, beta, sums);
        } else {
            gather_actor(job, at, &chunk);
            loss_actor(job->loss, &chunk, gradient, beta, sums);
        }
    }
    product_leave(entered);
}

static int64_t range_begin(int64_t count, int range) {
    return range >= PPO_RANGES ? count : count * range / PPO_RANGES / 16 * 16;
}

static void add_range(float *restrict sum, const float *restrict more, int64_t count) {
#pragma omp simd
    for (int64_t i = 0; i < count; i++) {
        sum[i] += more[i];
    }
}

/* Sum of this process's shards into its first over a range, ((0+1)+(2+3))+((4+5)+(6+7)) and so on.
 * Together with ranks_sum that is the sum of all in this order, for any number of processes. */
static void reduce_piece(void *context, int range, int thread) {
    (void)thread;
    GradientJob *job = context;
    const Ppo *ppo = job->ppo;
    const int64_t begin = range_begin(ppo->policy->network.count, range),
                  end = range_begin(ppo->policy->network.count, range + 1);
    float *gradient = ppo->gradient + begin;
    for (int step = 1; step < ppo->part.shards; step *= 2) {
        for (int own = 0; own < ppo->part.shards; own += 2 * step) {
            add_range(gradient + (size_t)own * ppo->stride,
                      gradient + (size_t)(own + step) * ppo->stride, end - begin);
        }
    }
}

/* Squared norm of a range of the sum. */
static void square_piece(void *context, int range, int thread) {
    (void)thread;
    GradientJob *job = context;
    const Ppo *ppo = job->ppo;
    const int64_t end = range_begin(ppo->policy->network.count, range + 1);
    const float *gradient = ppo->gradient;
    double squares = 0.0;
#pragma omp simd reduction(+ : squares)
    for (int64_t i = range_begin(ppo->policy->network.count, range); i < end; i++) {
        squares += (double)gradient[i] * gradient[i];
    }
    job->squares[range] = squares;
}

static void add_sums(LossSums *to, const LossSums *from) {
    to->surrogate += from->surrogate;
    to->kl += from->kl;
    to->clipped += from->clipped;
    to->reconstruction += from->reconstruction;
    to->vae_kl += from->vae_kl;
    for (int g = 0; g < LOSS_GROUPS; g++) {
        to->estimate[g] += from->estimate[g];
    }
    to->mirror += from->mirror;
    to->value += from->value;
}

/* The sums of a shard are zero but in the one process that has it, so theirs are exact. */
static void sum_over_ranks(GradientJob *job) {
    const Ppo *ppo = job->ppo;
    ranks_sum(ppo->ranks, ppo->gradient, ppo->policy->network.count);
    ranks_sum_double(ppo->ranks, (double *)(void *)job->sums,
                     2 * ppo->part.all * (int64_t)(sizeof(LossSums) / sizeof(double)));
}

void ppo_gradient(Ppo *ppo, const LossContext *context, const PpoMinibatch *minibatch,
                  LossSums *sums, double *norm) {
    GradientJob job = {.ppo = ppo, .loss = context, .minibatch = minibatch};
    *sums = (LossSums){0};
    pool_run(ppo->pool, 2 * ppo->part.shards, gradient_piece, &job);
    pool_run(ppo->pool, PPO_RANGES, reduce_piece, &job);
    sum_over_ranks(&job);
    for (int piece = 0; piece < 2 * ppo->part.all; piece++) {
        add_sums(sums, &job.sums[piece]);
    }
    pool_run(ppo->pool, PPO_RANGES, square_piece, &job);
    double squares = 0.0;
    for (int range = 0; range < PPO_RANGES; range++) {
        squares += job.squares[range];
    }
    *norm = sqrt(squares);
}

typedef struct {
    Ppo *ppo;
    AdamStep step;
} OptimiseJob;

/* Adam's step of parameters begin .. end - 1. */
static void adam_range(const OptimiseJob *job, int64_t begin, int64_t end) {
    const Ppo *ppo = job->ppo;
    if (begin < end) {
        adam_apply(job->step, end - begin, ppo->gradient + begin, ppo->policy->parameters + begin,
                   ppo->first + begin, ppo->second + begin);
    }
}

/* Adam's step of a range, but for what Muon moves. */
static void adam_piece(const OptimiseJob *job, int range) {
    const MuonMatrices *muon = &job->ppo->muon;
    const int64_t count = job->ppo->policy->network.count, end = range_begin(count, range + 1);
    int64_t begin = range_begin(count, range);
    for (int i = 0; i < muon->count; i++) {
        const MuonMatrix *m = &muon->matrix[i];
        const int64_t after = m->at + (int64_t)m->rows * m->columns;
        adam_range(job, begin, m->at < end ? m->at : end);
        begin = begin > after ? begin : after;
    }
    adam_range(job, begin, end);
}

static void muon_piece(const OptimiseJob *job, int piece, int thread) {
    const Ppo *ppo = job->ppo;
    const int entered = product_enter(ppo->def.matmul == PPO_MATMUL_BF16);
    muon_apply(&ppo->muon.matrix[piece], ppo->learning_rate, job->step.gradient_scale,
               ppo->gradient, ppo->policy->parameters, ppo->first,
               ppo->scratch + (size_t)thread * ppo->scratch_floats);
    product_leave(entered);
}

/* The matrices, which take longer, come first. */
static void optimise_piece(void *context, int piece, int thread) {
    const OptimiseJob *job = context;
    const int matrices = job->ppo->muon.count;
    if (piece < matrices) {
        muon_piece(job, piece, thread);
    } else {
        adam_piece(job, piece - matrices);
    }
}

void ppo_optimise(Ppo *ppo, double gradient_scale) {
    OptimiseJob job = {ppo, adam_step(ppo->learning_rate, ++ppo->adam_steps, gradient_scale)};
    pool_run(ppo->pool, ppo->muon.count + PPO_RANGES, optimise_piece, &job);
    const Network *n = &ppo->policy->network;
    const float floor = step_noise_floor(&ppo->def);
    for (int64_t i = n->log_std; i < n->count; i++) {
        ppo->policy->parameters[i] = fmaxf(ppo->policy->parameters[i], floor);
    }
}
