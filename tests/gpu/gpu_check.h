/* A learner on the CPU or on the GPU, and the distances between two of them. */
#ifndef MILD_TEST_GPU_CHECK_H
#define MILD_TEST_GPU_CHECK_H

#include "../learn/toy.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "learn/cuda/learner.h"
#include "learn/cuda/learner_private.h"
#include "learn/ppo_gradient.h"
#include "learn/ppo_private.h"

enum { ON_CPU, MIXED, RESIDENT };

typedef struct {
    Policy *policy;
    Pool *pool;
    Ppo *ppo;
    GpuLearner *gpu; /* NULL: on the CPU */
    int mirror_index[64];
    float mirror_sign[64];
    /* With a resident rollout a copy of it on the CPU, else the rollout. */
    PpoBatch batch;
    void *block;
} Learner;

/* Swaps neighbours and changes every third sign: its own inverse, as a mirror is. */
static inline PpoMirror some_mirror(Learner *l, const PolicyDef *def) {
    const int newest = policy_newest(def);
    const int count = newest > def->actions ? newest : def->actions;
    for (int i = 0; i < count; i++) {
        l->mirror_index[i] = i;
        l->mirror_sign[i] = i % 3 ? 1.0f : -1.0f;
    }
    for (int i = 0; i + 1 < def->actions && i + 1 < def->observation; i += 2) {
        l->mirror_index[i] = i + 1;
        l->mirror_index[i + 1] = i;
    }
    for (int i = 0; i < def->scan; i++) { /* within the scan */
        l->mirror_index[def->observation + i] = newest - 1 - i;
    }
    return (PpoMirror){l->mirror_index, l->mirror_sign, l->mirror_index, l->mirror_sign};
}

/* rows: most rows of a chunk on the device; 0: the default. ranks: with which it shares the
 * environments. */
static inline void learner_open_part(Learner *l, int where, const PolicyDef *policy,
                                     const PpoDef *def, int envs, int rows, Ranks *ranks) {
    MildError error = {0};
    memset(l, 0, sizeof *l);
    PpoMirror mirror =
        policy->observation == TOY_OBSERVATION ? toy_mirror() : some_mirror(l, policy);
    l->policy = policy_create(policy, 5, &error);
    l->pool = pool_create(where == ON_CPU ? 0 : 1);
    assert_true(l->policy && l->pool);
    l->ppo = ppo_create_part(def, l->policy, l->pool, &mirror, envs, 11, ranks, &error);
    assert_non_null(l->ppo);
    if (where != ON_CPU) {
        const GpuLearnerDef gpu = {
            .device = ranks_local(ranks), .resident = where == RESIDENT, .rows = rows};
        if (gpu_learner_attach(l->ppo, &gpu, &error)) {
            fail_msg("%s", error.text);
        }
        l->gpu = l->ppo->backend.self;
    }
    assert_int_equal(ppo_is_resident(l->ppo), where == RESIDENT);
    l->batch = *ppo_batch(l->ppo);
    if (where == RESIDENT) {
        const size_t bytes = ppo_batch_like(l->ppo, NULL, &l->batch);
        l->block = aligned_alloc(64, (bytes + 63) / 64 * 64);
        assert_non_null(l->block);
        ppo_batch_like(l->ppo, l->block, &l->batch);
        assert_int_equal(gpu_learner_read(l->ppo, l->block, &error), MILD_OK);
    }
}

static inline void learner_open(Learner *l, int where, const PolicyDef *policy, const PpoDef *def,
                                int envs, int rows) {
    learner_open_part(l, where, policy, def, envs, rows, NULL);
}

static inline void learner_close(Learner *l) {
    free(l->block);
    ppo_destroy(l->ppo);
    policy_destroy(l->policy);
    pool_destroy(l->pool);
}

/* Brings the device's rollout to the CPU, or back; nothing to do where it is there. */
static inline void learner_read(Learner *l) {
    assert_true(!l->block || gpu_learner_read(l->ppo, l->block, NULL) == MILD_OK);
}

static inline void learner_write(Learner *l) {
    assert_true(!l->block || gpu_learner_write(l->ppo, l->block, NULL) == MILD_OK);
}

static inline void learner_pull(Learner *l) {
    MildError error = {0};
    if (ppo_pull(l->ppo, &error)) {
        fail_msg("%s", error.text);
    }
}

/* After a change of the parameters or moments on the CPU. */
static inline void learner_push(Learner *l) {
    assert_true(!l->gpu || l->ppo->backend.push(l->gpu, NULL) == MILD_OK);
}

static inline PpoReport learner_update(Learner *l) {
    PpoReport report;
    MildError error = {0};
    ppo_update(l->ppo, &report);
    if (ppo_status(l->ppo, &error)) {
        fail_msg("%s", error.text);
    }
    return report;
}

/* Random parameters, because the modulation begins at zero otherwise. The second moments are those
 * of a run that has learned for a while: Adam's first steps divide every gradient by its own size,
 * which enlarges the rounding of small ones without bound. */
static inline void learner_fill_parameters(Learner *l, uint64_t seed) {
    Random random = random_at(seed, 1, 1);
    const Network *n = &l->policy->network;
    for (int64_t i = 0; i < n->log_std; i++) {
        l->policy->parameters[i] += (float)(0.03 * random_normal(&random));
    }
    for (int64_t i = 0; i < n->count; i++) {
        l->ppo->first[i] = (float)(1e-3 * random_normal(&random));
        l->ppo->second[i] = (float)(1e-2 * (1.0 + random_unit(&random)));
    }
    l->ppo->adam_steps = 10000;
    learner_push(l);
}

/* A random rollout but for what the policy adds to it. */
static inline void learner_fill_rollout(Learner *l, uint64_t seed) {
    Random random = random_at(seed, 1, 2);
    const Network *n = &l->policy->network;
    PpoBatch *b = &l->batch;
    const int64_t samples = (int64_t)b->steps * b->envs, more = samples + b->envs;
    fill_normal(b->history, more * n->history, 1.0, &random);
    fill_normal(b->critic, more * n->def.critic_input, 1.0, &random);
    fill_normal(b->target, more * n->def.estimates, 1.0, &random);
    fill_normal(b->frame, more * n->def.observation, 1.0, &random);
    fill_normal(b->reward, samples, 1.0, &random);
    for (int64_t i = 0; i < samples; i++) {
        b->done[i] = random_unit(&random) < 0.02;
        b->timeout[i] = b->done[i] && random_unit(&random) < 0.5;
        b->valid[i] = 1;
    }
    learner_write(l);
}

/* |a - b| / |b| over a range. */
static inline double distance(const float *a, const float *b, int64_t count) {
    double gap = 0.0, size = 0.0;
    for (int64_t i = 0; i < count; i++) {
        gap += ((double)a[i] - b[i]) * ((double)a[i] - b[i]);
        size += (double)b[i] * b[i];
    }
    return size > 0.0 ? sqrt(gap / size) : sqrt(gap);
}

static inline void worse(double *worst, double value) {
    assert_true(isfinite(value));
    *worst = value > *worst ? value : *worst;
}

/* Learns the toy task for some iterations; returns the last reward [1/s]. */
static inline double learner_play(Learner *l, Toy *toy, int iterations) {
    for (int i = 0; i < iterations; i++) {
        for (int t = 0; t < l->batch.steps; t++) {
            ppo_act(l->ppo, t);
            learner_read(l);
            toy_advance(toy, &l->batch, t);
            learner_write(l);
        }
        learner_update(l);
        learner_read(l);
    }
    return toy->reward;
}

static inline void learner_start_toy(Learner *l, Toy *toy) {
    memset(toy, 0, sizeof *toy);
    toy->envs = l->batch.envs;
    for (int e = 0; e < toy->envs; e++) {
        toy_reset(&toy->env[e], e);
        toy_observe(&toy->env[e], &l->batch, 0, e);
    }
    learner_write(l);
}

/* ---- updates ---- */

static inline void assert_close(const char *what, double ours, double expected, double bound) {
    if (!(fabs(ours - expected) <= bound * fmax(1.0, fabs(expected)))) {
        fail_msg("%s: %.9g, on the CPU %.9g", what, ours, expected);
    }
}

/* Everything that an update decides is the same, everything that it computes within `bound`. */
static inline void compare_reports(const PpoReport *a, const PpoReport *b, double bound) {
    assert_int_equal(a->skipped, b->skipped);
    assert_close("learning rate", a->learning_rate, b->learning_rate, 1e-12);
    assert_close("surrogate", a->surrogate, b->surrogate, bound);
    assert_close("value loss", a->value_loss, b->value_loss, bound);
    assert_close("entropy", a->entropy, b->entropy, bound);
    assert_close("kl", a->kl, b->kl, bound);
    assert_close("clip share", a->clip_share, b->clip_share, 1e-3); /* counts samples */
    assert_close("norm", a->gradient_norm, b->gradient_norm, bound);
    assert_close("std", a->action_std, b->action_std, bound);
    assert_close("reconstruction", a->vae_reconstruction, b->vae_reconstruction, bound);
    assert_close("vae kl", a->vae_kl, b->vae_kl, bound);
    for (int g = 0; g < 3; g++) {
        assert_close("estimates", a->estimate_loss[g], b->estimate_loss[g], bound);
    }
    assert_close("mirror", a->mirror, b->mirror, bound);
    assert_close("mean value", a->value_mean, b->value_mean, 1e-6);
    assert_close("deviation of the advantage", a->advantage_std, b->advantage_std, 1e-6);
    assert_close("explained variance", a->explained_variance, b->explained_variance, 1e-5);
}

/* What may be wrong with a rollout. */
enum { NOTHING, INVALID, NOT_FINITE, STARVED, FAULTS };

static inline void spoil(PpoBatch *b, const Network *n, int fault) {
    const int samples = b->steps * b->envs;
    for (int i = 0; i < samples; i++) {
        if (fault == INVALID && (i % 11 == 3 || i >= samples - b->envs / 2)) {
            b->valid[i] = 0;
            b->reward[i] = b->history[(int64_t)i * n->history] = NAN;
            b->frame[(int64_t)i * n->def.observation] = b->target[i * n->def.estimates] = NAN;
        }
        if (fault == STARVED && i % b->envs < b->envs / 8) {
            b->valid[i] = 0;
        }
    }
    if (fault == NOT_FINITE) { /* one minibatch of every epoch; and a value, as if not valid */
        b->history[(int64_t)(samples / 2) * n->history + 1] = NAN;
        b->critic[(int64_t)(samples / 3) * n->def.critic_input + 1] = INFINITY;
    }
}

/* ---- a learner with a part of the environments, or all, against one on the CPU ---- */

/* Numbers of the part's environments, [times][width] of each, from those of all. */
static inline void take_part(OrderPart part, int times, size_t width, const void *whole,
                             void *own) {
    for (int t = 0; t < times; t++) {
        const size_t from = (size_t)t * (size_t)part.envs + (size_t)part.first,
                     to = (size_t)t * (size_t)part.width;
        memcpy((char *)own + to * width, (const char *)whole + from * width,
               (size_t)part.width * width);
    }
}

static inline void take_rollout(OrderPart part, const Network *n, const PpoBatch *whole,
                                PpoBatch *own) {
    const size_t number = sizeof(float);
    const int steps = whole->steps, more = steps + 1;
    take_part(part, more, (size_t)n->history * number, whole->history, own->history);
    take_part(part, more, (size_t)n->def.critic_input * number, whole->critic, own->critic);
    take_part(part, more, (size_t)n->def.estimates * number, whole->target, own->target);
    take_part(part, more, (size_t)n->def.observation * number, whole->frame, own->frame);
    take_part(part, steps, (size_t)n->def.actions * number, whole->action, own->action);
    take_part(part, steps, (size_t)n->def.actions * number, whole->mean, own->mean);
    take_part(part, steps, number, whole->log_prob, own->log_prob);
    take_part(part, steps, number, whole->reward, own->reward);
    take_part(part, steps, 1, whole->done, own->done);
    take_part(part, steps, 1, whole->timeout, own->timeout);
    take_part(part, steps, 1, whole->valid, own->valid);
}

/* Largest |a - b| over [steps][width] of the part, where a has all environments. */
static inline double part_gap(OrderPart part, int steps, int width, const float *a,
                              const float *b) {
    double gap = 0.0;
    for (int t = 0; t < steps; t++) {
        for (int i = 0; i < part.width * width; i++) {
            const double whole = a[((int64_t)t * part.envs + part.first) * width + i],
                         own = b[(int64_t)t * part.width * width + i];
            worse(&gap, fabs(whole - own));
        }
    }
    return gap;
}

/* Actions of both; then those of the whole count, with ratios outside their clip range. */
static inline void act_in_part(Learner *whole, Learner *own, OrderPart part) {
    PpoBatch *a = &whole->batch, *b = &own->batch;
    const int actions = policy_def(whole->policy)->actions;
    for (int t = 0; t < a->steps; t++) {
        ppo_act(whole->ppo, t);
        ppo_act(own->ppo, t);
    }
    learner_read(own);
    assert_true(part_gap(part, a->steps, actions, a->mean, b->mean) < 1e-4);
    assert_true(part_gap(part, a->steps, actions, a->action, b->action) < 1e-4);
    assert_true(part_gap(part, a->steps, 1, a->log_prob, b->log_prob) < 1e-3);
    Random random = random_at(8, 8, 9);
    for (int64_t i = 0; i < (int64_t)a->steps * a->envs; i++) {
        a->log_prob[i] += (float)(0.2 * random_normal(&random));
    }
}

/* The samples of this process's last minibatch are those of its shards, in their order. */
static inline void check_order(Learner *whole, Learner *own, OrderPart part) {
    const PpoDef *def = &whole->ppo->def;
    const int samples = def->steps * part.width;
    int cut[PPO_SHARDS_MAX + 1], own_cut[PPO_SHARDS_MAX + 1];
    int *order = malloc((size_t)samples * sizeof *order);
    assert_non_null(order);
    order_cuts(part.all, def->steps, part.envs, def->minibatches - 1, def->minibatches, cut);
    const int count = order_own_cuts(part, cut, own_cut), begin = cut[part.shard];
    cudaMemcpyAsync(order, own->gpu->order, (size_t)count * sizeof *order, cudaMemcpyDeviceToHost,
                    own->gpu->queue.stream);
    assert_int_equal(cudaStreamSynchronize(own->gpu->queue.stream), cudaSuccess);
    for (int p = 0; p < count; p++) {
        const int t = order[p] / part.width, env = order[p] % part.width + part.first;
        assert_int_equal(t * part.envs + env, whole->ppo->order[begin + p]);
    }
    free(order);
}

/* What only a learner with all environments has: the same substitutes, the same rows at the
 * beginning of the next rollout, moments and averages. */
static inline void check_whole(Learner *whole, Learner *own, int where) {
    const Network *n = &whole->policy->network;
    const size_t samples = (size_t)whole->batch.steps * (size_t)whole->batch.envs;
    const size_t envs = (size_t)whole->batch.envs * sizeof(float);
    int *order = malloc(samples * sizeof *order);
    assert_non_null(order);
    if (where == RESIDENT) {
        cudaMemcpyAsync(order, own->gpu->substitute, samples * sizeof *order,
                        cudaMemcpyDeviceToHost, own->gpu->queue.stream);
        assert_int_equal(cudaStreamSynchronize(own->gpu->queue.stream), cudaSuccess);
        assert_memory_equal(order, whole->ppo->substitute, samples * sizeof *order);
    }
    free(order);
    assert_int_equal(own->ppo->iteration, whole->ppo->iteration);
    assert_memory_equal(own->ppo->start.history, whole->ppo->start.history,
                        envs * (size_t)n->history);
    assert_memory_equal(own->ppo->start.frame, whole->ppo->start.frame,
                        envs * (size_t)n->def.observation);
    assert_true(distance(own->ppo->first, whole->ppo->first, n->count) < 1e-4);
    if (whole->ppo->def.average > 0.0) {
        assert_true(distance(policy_parameters(own->ppo->average),
                             policy_parameters(whole->ppo->average), n->count) < 1e-4);
    }
}

/* All processes have the same bits. */
static inline void check_same(Learner *own, Ranks *ranks) {
    const size_t bytes = (size_t)policy_parameter_count(own->policy) * sizeof(float);
    const float *mine = policy_parameters(own->policy);
    float *first = malloc(bytes);
    uint64_t hash = ppo_hash(own->ppo);
    assert_non_null(first);
    memcpy(first, mine, bytes);
    if (ranks) {
        ranks_broadcast(ranks, first, bytes);
        ranks_broadcast(ranks, &hash, sizeof hash);
    }
    assert_memory_equal(first, mine, bytes);
    assert_true(hash == ppo_hash(own->ppo));
    free(first);
}

static inline void fill_both(Learner *whole, Learner *own, OrderPart part, int round, int fault) {
    const Network *n = &whole->policy->network;
    learner_fill_rollout(whole, 3 + (uint64_t)round);
    take_rollout(part, n, &whole->batch, &own->batch);
    learner_write(own);
    act_in_part(whole, own, part);
    spoil(&whole->batch, n, fault);
    take_rollout(part, n, &whole->batch, &own->batch);
    learner_write(own);
}

/* Updates from the same rollout: decisions, advantages, order, and how far the parameters move. */
static inline double compare_update(int where, const PolicyDef *policy, const PpoDef *def, int envs,
                                    int rows, int fault, Ranks *ranks) {
    Learner whole, own;
    learner_open(&whole, ON_CPU, policy, def, envs, 0);
    learner_open_part(&own, where, policy, def, envs, rows, ranks);
    const OrderPart part = own.ppo->part;
    const Network *n = &whole.policy->network;
    const size_t bytes = (size_t)n->count * sizeof(float);
    float *before = malloc(bytes), *steps[2] = {malloc(bytes), malloc(bytes)};
    double moved = 0.0;
    uint64_t hash = 0;
    assert_true(before && steps[0] && steps[1]);
    for (int round = 0; round < 3; round++) { /* from the second on a graph's */
        Learner *const both[] = {&whole, &own};
        PpoReport report[2];
        memcpy(own.policy->parameters, whole.policy->parameters, bytes);
        for (int k = 0; k < 2; k++) {
            learner_fill_parameters(both[k], 3);
        }
        memcpy(before, whole.policy->parameters, bytes);
        fill_both(&whole, &own, part, round, fault);
        for (int k = 0; k < 2; k++) {
            report[k] = learner_update(both[k]);
            learner_pull(both[k]);
            learner_read(both[k]);
            for (int64_t i = 0; i < n->count; i++) {
                steps[k][i] = both[k]->policy->parameters[i] - before[i];
            }
        }
        compare_reports(&report[1], &report[0], 1e-4);
        assert_int_equal(report[0].skipped > 0, fault >= NOT_FINITE);
        const PpoBatch *a = &whole.batch, *b = &own.batch;
        assert_true(where == MIXED ||
                    part_gap(part, def->steps, 1, a->advantage, b->advantage) < 1e-4);
        assert_true(where == MIXED || part_gap(part, def->steps, 1, a->returns, b->returns) < 1e-4);
        check_order(&whole, &own, part);
        check_same(&own, ranks);
        if (ranks_count(ranks) == 1) {
            check_whole(&whole, &own, where);
        }
        assert_int_equal(own.ppo->adam_steps, whole.ppo->adam_steps);
        assert_true(ranks_count(ranks) == 1 || fault == STARVED || ppo_hash(own.ppo) != hash);
        hash = ppo_hash(own.ppo);
        if (fault == STARVED) {
            assert_memory_equal(steps[1], steps[0], bytes);
        } else {
            worse(&moved, distance(steps[1], steps[0], n->count));
        }
    }
    free(before);
    free(steps[0]);
    free(steps[1]);
    learner_close(&whole);
    learner_close(&own);
    return moved;
}

#endif
