/* Proximal policy optimisation (Schulman et al. 2017) with asymmetric critic, joint VAE loss (paper
 * eqs 16-17), mirror loss and KL-adapted learning rate. Loss = epsilon*loss_reg +
 * (1-epsilon)*(surrogate + value + entropy) + mirror. */
#ifndef MILD_PPO_H
#define MILD_PPO_H

#include "learn/policy.h"

/* Frame that the decoder rebuilds from z and the estimates: the newest one of the history, which
 * the actor has anyway, or the one that follows it, which makes z predict how the ground answers.
 * An episode's last frame has no successor and rebuilds itself. */
typedef enum { PPO_TARGET_NEWEST, PPO_TARGET_NEXT, PPO_TARGETS } PpoTarget;

typedef struct {
    int steps;       /* rollout length per environment, 24 */
    int epochs;      /* 4 */
    int minibatches; /* 4 */
    double gamma, lambda;
    double clip;
    double entropy; /* weight */
    double value_weight;
    int clip_value; /* bool */
    double learning_rate, learning_rate_min, learning_rate_max;
    double kl_target; /* 0: fixed learning rate */
    double max_gradient_norm;
    double epsilon;     /* 0.3: share of loss_reg in the joint loss (eq 16) */
    int decoder_target; /* a PpoTarget */
    double kl_weight;   /* phi of the VAE's KL term */
    double mirror_weight;
    double mirror_share;  /* share of each minibatch on which the mirror loss is evaluated */
    double std_min;       /* floor of the action noise */
    int anneal[2];        /* first and last iteration of the end game; equal: none */
    double anneal_factor; /* what KL target and greatest rate are multiplied by at its end */
    double std_max[2];    /* ceiling of the action noise before and after it */
    double average; /* decay per iteration of the weights' running mean, which is what gets saved as
                       the policy; 0: none */
} PpoDef;
PpoDef ppo_def_default(void);
extern const MildField ppo_fields[];
extern const int ppo_field_count;

/* Mirror symmetry of the problem: o'_i = sign_i * o_perm_i for one frame and for the action. NULL
 * perm: no mirror loss. */
typedef struct {
    const int *observation_index;  /* [observation] */
    const float *observation_sign; /* [observation] */
    const int *action_index;       /* [actions] */
    const float *action_sign;      /* [actions] */
} PpoMirror;

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

typedef struct Ppo Ppo;
/* Borrows policy and pool. estimate groups: widths 3, 6, 2 for the report. */
Ppo *ppo_create(const PpoDef *def, Policy *policy, Pool *pool, const PpoMirror *mirror, int envs,
                uint64_t seed, MildError *error);
void ppo_destroy(Ppo *ppo);
PpoBatch *ppo_batch(Ppo *ppo);
size_t ppo_bytes(const Ppo *ppo); /* memory held */
/* Fills batch->action/mean/log_prob at time t from batch->history[t]; noise is a function of (seed,
 * iteration, t, env). */
void ppo_act(Ppo *ppo, int t);
/* Values, GAE, epochs of minibatches; moves history[steps] etc. to index 0 for the next rollout;
 * iteration += 1. */
void ppo_update(Ppo *ppo, PpoReport *report);
int64_t ppo_iteration(const Ppo *ppo);
/* The running mean of the weights (Polyak and Juditsky 1992), or the policy itself with def.average
 * = 0. Owned by ppo. */
Policy *ppo_average(Ppo *ppo);
/* What stopped the compute backend, if anything did; the parameters are still those of the last
 * good step. */
MildStatus ppo_status(const Ppo *ppo, MildError *error);

/* Everything that resuming needs: parameters, moments, rate, counters, plus an opaque block of the
 * caller (the environments' state). One safetensors file with CRC32, temporary name then rename. On
 * load nothing is changed unless the whole file is good. extra_size must match on load. */
MildStatus ppo_save(const Ppo *ppo, const char *path, const void *extra, size_t extra_size,
                    const char *note, MildError *error);
MildStatus ppo_load(Ppo *ppo, const char *path, void *extra, size_t extra_size, MildError *error);

#endif
