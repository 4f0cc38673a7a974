/* A toy task: two point masses on a line that are to reach 0 and stay there. Mirroring changes
 * every sign. */
#ifndef MILD_TEST_LEARN_TOY_H
#define MILD_TEST_LEARN_TOY_H

#include <string.h>

#include "check.h"
#include "learn/ppo.h"

#define TOY_OBSERVATION 6 /* positions, velocities, last action */
#define TOY_FRAMES 2
#define TOY_EPISODE 60
#define TOY_ENVS_MAX 64
#define TOY_PERIOD 0.1 /* [s] */

typedef struct {
    double x[2], v[2], last[2];
    float frames[TOY_FRAMES * TOY_OBSERVATION];
    uint32_t step, episode;
} ToyEnv;

typedef struct {
    int envs;
    ToyEnv env[TOY_ENVS_MAX];
    double reward; /* [1/s] mean of the last rollout */
} Toy;

static inline PolicyDef toy_policy_def(void) {
    PolicyDef def = policy_def_default();
    def.observation = TOY_OBSERVATION;
    def.frames = TOY_FRAMES;
    def.critic_input = 6;
    def.actions = 2;
    def.estimates = 4;
    def.feet_velocity_offset = 1;
    def.feet_velocity_count = 2;
    def.latent = 4;
    def.encoder_hidden[0] = 32, def.encoder_hidden[1] = 0;
    def.decoder_hidden[0] = 32, def.decoder_hidden[1] = 0;
    def.modulation_hidden = 8;
    def.actor_hidden[0] = 32, def.actor_hidden[1] = 32, def.actor_hidden[2] = 0;
    def.critic_hidden[0] = 32, def.critic_hidden[1] = 32, def.critic_hidden[2] = 0;
    return def;
}

static inline PpoDef toy_ppo_def(void) {
    PpoDef def = ppo_def_default();
    def.steps = 40;
    def.minibatches = 2;
    return def;
}

static inline PpoMirror toy_mirror(void) {
    static const int index[TOY_OBSERVATION] = {0, 1, 2, 3, 4, 5};
    static const float sign[TOY_OBSERVATION] = {-1, -1, -1, -1, -1, -1};
    return (PpoMirror){index, sign, index, sign};
}

static inline void toy_reset(ToyEnv *env, int number) {
    Random random = random_at(99, (uint32_t)number, env->episode++);
    memset(env->frames, 0, sizeof env->frames);
    for (int i = 0; i < 2; i++) {
        env->x[i] = random_uniform(&random, -1.0, 1.0);
        env->v[i] = env->last[i] = 0.0;
    }
    env->step = 0;
}

static inline void toy_observe(ToyEnv *env, PpoBatch *b, int t, int e) {
    const int64_t row = (int64_t)t * b->envs + e;
    const double now[TOY_OBSERVATION] = {env->x[0], env->x[1],    env->v[0],
                                         env->v[1], env->last[0], env->last[1]};
    memmove(env->frames, env->frames + TOY_OBSERVATION,
            sizeof env->frames - TOY_OBSERVATION * sizeof(float));
    for (int i = 0; i < TOY_OBSERVATION; i++) {
        env->frames[(TOY_FRAMES - 1) * TOY_OBSERVATION + i] = (float)now[i];
        b->critic[row * 6 + i] = (float)now[i];
        b->frame[row * TOY_OBSERVATION + i] = (float)now[i];
    }
    memcpy(b->history + row * TOY_FRAMES * TOY_OBSERVATION, env->frames, sizeof env->frames);
    for (int i = 0; i < 4; i++) {
        b->target[row * 4 + i] = (float)now[i];
    }
}

static inline double toy_step(ToyEnv *env, const float *action) {
    double reward = 0.0;
    for (int i = 0; i < 2; i++) {
        double a = action[i] < -2.0f ? -2.0 : action[i] > 2.0f ? 2.0 : action[i];
        env->v[i] += TOY_PERIOD * (4.0 * a - 0.5 * env->v[i]);
        env->x[i] += TOY_PERIOD * env->v[i];
        env->last[i] = a;
        reward += 0.5 * exp(-4.0 * env->x[i] * env->x[i]);
    }
    env->step++;
    return reward;
}

static inline void toy_start(Toy *toy, Ppo *ppo) {
    memset(toy, 0, sizeof *toy);
    toy->envs = ppo_batch(ppo)->envs;
    for (int e = 0; e < toy->envs; e++) {
        toy_reset(&toy->env[e], e);
        toy_observe(&toy->env[e], ppo_batch(ppo), 0, e);
    }
}

/* Steps all environments with the actions of time t. */
static inline void toy_advance(Toy *toy, PpoBatch *b, int t) {
    toy->reward = t == 0 ? 0.0 : toy->reward;
    for (int e = 0; e < b->envs; e++) {
        const int64_t i = (int64_t)t * b->envs + e;
        ToyEnv *env = &toy->env[e];
        const double rate = toy_step(env, b->action + i * 2); /* [1/s] */
        b->reward[i] = (float)(TOY_PERIOD * rate);
        b->timeout[i] = env->step >= TOY_EPISODE;
        b->done[i] = b->timeout[i] || fabs(env->x[0]) > 3.0 || fabs(env->x[1]) > 3.0;
        b->valid[i] = 1;
        toy->reward += rate / ((double)b->steps * b->envs);
        if (b->done[i]) {
            toy_reset(env, e);
        }
        toy_observe(env, b, t + 1, e);
    }
}

static inline void toy_rollout(Toy *toy, Ppo *ppo) {
    PpoBatch *b = ppo_batch(ppo);
    for (int t = 0; t < b->steps; t++) {
        ppo_act(ppo, t);
        toy_advance(toy, b, t);
    }
}

/* A learner on it. */
typedef struct {
    Policy *policy;
    Pool *pool;
    Ppo *ppo;
    Toy toy;
} ToyRun;

static inline void toy_run_open(ToyRun *run, int threads, int envs, PolicyDef policy_def,
                                PpoDef def) {
    MildError error = {0};
    PpoMirror mirror = toy_mirror();
    ppo_set_decoder(&def, 2, 2, &policy_def); /* the speeds, if any */
    run->policy = policy_create(&policy_def, 5, &error);
    run->pool = pool_create(threads);
    assert_non_null(run->policy);
    assert_non_null(run->pool);
    run->ppo = ppo_create(&def, run->policy, run->pool, &mirror, envs, 11, &error);
    assert_non_null(run->ppo);
    toy_start(&run->toy, run->ppo);
}

static inline void toy_run_close(ToyRun *run) {
    ppo_destroy(run->ppo);
    policy_destroy(run->policy);
    pool_destroy(run->pool);
}

static inline PpoReport toy_run_iterate(ToyRun *run, int count) {
    PpoReport report = {0};
    for (int i = 0; i < count; i++) {
        toy_rollout(&run->toy, run->ppo);
        ppo_update(run->ppo, &report);
    }
    return report;
}

#endif
