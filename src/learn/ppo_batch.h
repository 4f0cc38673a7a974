/* What goes into an update of the learner, and what it says afterwards. */
#ifndef MILD_PPO_BATCH_H
#define MILD_PPO_BATCH_H

#include <stdint.h>

/* The rollout: the environments write straight into these arrays, time-major [t][env][...]. */
typedef struct {
    int steps, envs;
    float *history;   /* [steps+1][envs][frames*observation] */
    float *critic;    /* [steps+1][envs][critic_input] */
    float *target;    /* [steps+1][envs][estimates] true estimates for the regression heads */
    float *frame;     /* [steps+1][envs][observation] newest frame, as the policy saw it; the update
                      turns rows 0 .. steps-1 into what the decoder is to rebuild */
    float *action;    /* [steps][envs][actions] sampled */
    float *mean;      /* [steps][envs][actions] */
    float *log_prob;  /* [steps][envs] */
    float *reward;    /* [steps][envs] */
    uint8_t *done;    /* [steps][envs] episode ended at this step (failure or time-out) */
    uint8_t *timeout; /* [steps][envs] ended by time: bootstrap with gamma * V(s_t) */
    uint8_t *valid;   /* [steps][envs] 0: numbers went bad here; the sample gets no weight */
    float *value, *advantage, *returns; /* [steps+1 or steps][envs], filled by the learner */
} PpoBatch;

typedef struct {
    double surrogate, value_loss, entropy, kl, clip_share, learning_rate, gradient_norm, action_std;
    double vae_reconstruction, vae_kl, estimate_loss[3], mirror, value_mean, advantage_std,
        explained_variance;
    int skipped; /* minibatches dropped because a number was not finite */
} PpoReport;

#endif
