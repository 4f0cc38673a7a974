/* Input and report of an update of the learner. */
#ifndef MILD_PPO_BATCH_H
#define MILD_PPO_BATCH_H

#include <stdint.h>

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

#endif
