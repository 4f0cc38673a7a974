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
    const int count = def->observation > def->actions ? def->observation : def->actions;
    for (int i = 0; i < count; i++) {
        l->mirror_index[i] = i;
        l->mirror_sign[i] = i % 3 ? 1.0f : -1.0f;
    }
    for (int i = 0; i + 1 < def->actions && i + 1 < def->observation; i += 2) {
        l->mirror_index[i] = i + 1;
        l->mirror_index[i + 1] = i;
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

#endif
