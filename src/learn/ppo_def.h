/* What a learner is made of: section [ppo] of a config file, and the mirror symmetry of the
 * problem. */
#ifndef MILD_PPO_DEF_H
#define MILD_PPO_DEF_H

#include "learn/policy_def.h"
#include "mild/field.h"

/* What the decoder reconstructs from z and the estimates: the newest frame of the history, the next
 * frame, the ground's parameters in the critic's input, or the next frame and the parameters. The
 * next frame makes z predict how the ground answers, while the actor sees the newest one anyway.
 * The last frame of an episode has no successor and is its own target. The loss is
 *     mean over the frame of (decoded - frame)^2 + mean over the ground of (decoded - ground)^2,
 * each mean over its own numbers, so that 47 of a frame do not outweigh 13 of the ground. The shape
 * in PolicyDef says the same: ppo_set_decoder. */
typedef enum {
    PPO_TARGET_NEWEST,
    PPO_TARGET_NEXT,
    PPO_TARGET_GROUND,
    PPO_TARGET_BOTH,
    PPO_TARGETS
} PpoTarget;

/* Arithmetic of the matrix products on a GPU: 32-bit floats, or factors rounded to 11 (TF32) or 8
 * (bfloat16) significant bits, which the tensor cores multiply. Sums have 32 bits always. */
typedef enum { PPO_MATMUL_FP32, PPO_MATMUL_TF32, PPO_MATMUL_BF16, PPO_MATMULS } PpoMatmul;

/* Who moves the weights between hidden layers: Adam, as all other parameters, or Muon
 * (optimiser.h). */
typedef enum { PPO_OPTIMIZER_ADAM, PPO_OPTIMIZER_MUON, PPO_OPTIMIZERS } PpoOptimizer;
extern const char *const ppo_optimizer_names[PPO_OPTIMIZERS];

typedef struct {
    int steps;       /* rollout length per environment, 24 */
    int epochs;      /* 4 */
    int minibatches; /* 4 */
    int shards;      /* 8, of a minibatch: a power of two, and at most as many processes */
    double gamma;    /* [-] discount per policy step */
    double lambda;   /* [-] decay of generalised advantage estimation */
    double clip;     /* [-] of the probability ratio and of the change of the value */
    double entropy;  /* weight */
    double value_weight;
    int clip_value;       /* bool */
    int optimizer;        /* a PpoOptimizer */
    double learning_rate; /* at the start */
    double learning_rate_min;
    double learning_rate_max;
    double kl_target; /* [nat] 0: fixed learning rate */
    double max_gradient_norm;
    double epsilon;     /* 0.3: share of loss_reg in the joint loss (eq 16) */
    int decoder_target; /* a PpoTarget */
    int target_noise;   /* bool: its frame as the policy sees it; 0: without noise, as the critic */
    double kl_weight;   /* phi of the VAE's KL term */
    double free_bits;   /* [nat] KL of a latent dimension below which it costs nothing */
    int sample_latent;  /* bool: in training the actor's z is a draw of N(mu, e^logvar), else mu */
    int modulation; /* bool: the modulation learns; 0: it stays as it starts, which is identity */
    double mirror_weight;
    double mirror_share;  /* share of each minibatch on which the mirror loss is evaluated */
    double std_min;       /* lower bound of the action noise */
    int anneal[2];        /* first and last iteration of the annealing; equal: none */
    double anneal_factor; /* factor on KL target and greatest rate at its end */
    double std_max[2];    /* upper bound of the action noise before and after it */
    double average; /* decay per iteration of the running mean of the weights, which is saved as the
                       policy; 0: none */
    int matmul;     /* a PpoMatmul */
} PpoDef;
PpoDef ppo_def_default(void);
/* The shape of the decoder that a target needs. ground_offset, ground_count: of the task. */
void ppo_set_decoder(const PpoDef *def, int ground_offset, int ground_count, PolicyDef *policy);
extern const MildField ppo_fields[];
extern const int ppo_field_count;

/* Mirror symmetry of the problem: o'_i = sign_i * o_perm_i for one frame, behind the newest one for
 * the scan, and for the action. NULL perm: no mirror loss. */
typedef struct {
    const int *observation_index;  /* [observation + scan] */
    const float *observation_sign; /* [observation + scan] */
    const int *action_index;       /* [actions] */
    const float *action_sign;      /* [actions] */
} PpoMirror;

#endif
