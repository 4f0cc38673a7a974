/* Input and report of an update of the learner. */
#ifndef MILD_PPO_BATCH_H
#define MILD_PPO_BATCH_H

#include <math.h>
#include <stdint.h>

#include "base/hd.h"

/* The rollout. The environments write directly into these arrays, [time][environment][...]. */
typedef struct {
    int steps, envs;
    float *history; /* [steps+1][envs][frames*observation + scan] */
    float *critic;  /* [steps+1][envs][critic_input] */
    float *target;  /* [steps+1][envs][estimates] true estimates for the regression heads */
    /* [steps+1][envs][observation] Newest frame, as the policy saw it. The update may replace rows
     * 0 .. steps - 1 by the decoder's targets. */
    float *frame;
    float *action;    /* [steps][envs][actions] sampled */
    float *mean;      /* [steps][envs][actions] */
    float *log_prob;  /* [steps][envs] */
    float *reward;    /* [steps][envs] */
    uint8_t *done;    /* [steps][envs] episode ended at this step (failure or time-out) */
    uint8_t *timeout; /* [steps][envs] ended by time: bootstrap with gamma * V(s_t) */
    uint8_t *valid;   /* [steps][envs] 0: a number was not finite here; the sample gets no weight */
    /* filled by the learner; on a device, only where the rollout is resident */
    float *value;     /* [steps+1][envs] */
    float *advantage; /* [steps][envs] */
    float *returns;   /* [steps][envs] */
} PpoBatch;

typedef struct {
    double surrogate, value_loss, entropy, kl, clip_share, learning_rate, gradient_norm, action_std;
    double vae_reconstruction, vae_kl, estimate_loss[3], mirror, value_mean, advantage_std,
        explained_variance;
    int skipped; /* minibatches dropped because a number was not finite */
} PpoReport;

/* Advantages of one environment, for CPU (ppo_returns.c) and GPU (cuda/update.cu). Written in the
 * common subset of C17 and CUDA C++. */

/* Bool: sample i is valid and its numbers are finite. */
MILD_HD_FN int returns_usable(const PpoBatch *b, int64_t i) {
    return b->valid[i] && isfinite(b->value[i]) && isfinite(b->reward[i]);
}

/* Backward over time:
 *   delta_t = r_t + gamma V(s_t+1) (1 - done) - V(s_t),  A_t = delta_t + gamma lambda (1 - done)
 * A_t+1, where an end by time has r_t += gamma V(s_t), as if the episode went on. An unusable
 * sample cuts like an end. */
MILD_HD_FN void returns_environment(double gamma, double lambda, const PpoBatch *b, int env) {
    double advantage = 0.0, next_value = b->value[(int64_t)b->steps * b->envs + env];
    next_value = isfinite(next_value) ? next_value : 0.0;
    for (int t = b->steps - 1; t >= 0; t--) {
        const int64_t i = (int64_t)t * b->envs + env;
        if (!returns_usable(b, i)) {
            b->advantage[i] = b->returns[i] = 0.0f;
            advantage = 0.0;
            next_value = isfinite(b->value[i]) ? b->value[i] : 0.0;
            continue;
        }
        const double value = b->value[i], live = b->done[i] ? 0.0 : 1.0;
        const double reward = b->reward[i] + (b->done[i] && b->timeout[i] ? gamma * value : 0.0);
        const double delta = reward + live * gamma * next_value - value;
        advantage = delta + live * gamma * lambda * advantage;
        b->advantage[i] = (float)advantage;
        b->returns[i] = (float)(advantage + value);
        next_value = value;
    }
}

/* Bool: the frame of sample i = (t, env) is followed by one that it may be replaced with as the
 * decoder's target. The last frame of an episode and a frame before one that is not valid stay. */
MILD_HD_FN int returns_has_next(const PpoBatch *b, int t, int64_t i) {
    return !b->done[i] && (t + 1 == b->steps || b->valid[i + b->envs]);
}

#endif
