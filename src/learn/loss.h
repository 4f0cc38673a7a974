/* Loss and gradient of one chunk of samples. Two independent halves: the actor's (encoder,
 * modulation, actor, decoder, log std) and the critic's.
 *
 *   L = (1-eps) (surrogate - w_H entropy + w_V value) + eps (recon + phi KL + sum over groups MSE)
 * + w_M mirror   (eq 16)
 *
 * Means are over the minibatch: the caller gives 1 / (its samples), so that chunks and shards
 * simply add up. */
#ifndef MILD_LOSS_H
#define MILD_LOSS_H

#include "learn/network.h"
#include "learn/ppo_def.h"

#define LOSS_GROUPS                                                                                \
    3 /* estimates before, in and after the feet velocities: base velocity, feet velocities, feet  \
         heights */

/* Constants of one minibatch. */
typedef struct {
    const PpoDef *def;
    const Network *network;
    const PpoMirror *mirror; /* NULL: none */
    const float *parameters;
    float sample_weight; /* 1 / samples in the minibatch */
    float mirror_weight; /* 1 / samples of the minibatch that the mirror loss sees */
    float std[NETWORK_ACTIONS_MAX], old_std[NETWORK_ACTIONS_MAX];
} LossContext;

/* Sums over samples (not yet divided); the entropy has no sum, it does not depend on the sample. */
typedef struct {
    double surrogate, kl, clipped, reconstruction, vae_kl, estimate[LOSS_GROUPS], mirror, value;
} LossSums;

/* One chunk, `rows` samples; history holds `mirrored` more rows behind them, the mirror images of
 * the first ones. */
typedef struct {
    int rows, mirrored;
    float *history;                   /* [rows + mirrored][history] */
    float *estimate, *decoder_target; /* targets [rows][estimates], [rows][observation] */
    float *noise;                     /* [rows][latent] standard normal, for the sampled z */
    float *action, *old_mean, *old_log_prob, *advantage; /* [rows][actions] twice, [rows] twice */
    float *critic, *old_value, *returns;                 /* [rows][critic_input], [rows] twice */
    NetworkOutputs outputs;
    MlpOutputs decoder, value;
    float *decoder_input, *spread; /* [rows][decoder_input]; exp(logvar / 2) [rows][latent] */
    float *d_mean, *d_heads, *d_theta, *d_actor_input, *d_feet; /* [rows + mirrored][...] */
    float *d_decoded, *d_decoder_input, *d_value;               /* [rows][...] */
    float *work[2];
} LossChunk;

/* Lays a chunk for at most `rows` samples and `mirrored` images into the block (NULL: only counts
 * floats). */
size_t loss_carve(const Network *network, int rows, int mirrored, float *block, LossChunk *chunk);
/* Copies row `from` of the chunk's history, mirrored, to row `to`. */
void loss_mirror_row(const LossContext *context, LossChunk *chunk, int from, int to);

/* Add to the sums and to the gradient's ranges of their half (beta 0 overwrites instead). */
void loss_actor(const LossContext *context, LossChunk *chunk, float *gradient, float beta,
                LossSums *sums);
void loss_critic(const LossContext *context, LossChunk *chunk, float *gradient, float beta,
                 LossSums *sums);

/* What no sample changes in the surrogate: 1/std [actions], then the constants of log_prob and of
 * KL(old || new) = sum log(std/old) + (old^2 + (old_mean - mean)^2) / (2 std^2) - 1/2. */
void loss_surrogate_constants(const LossContext *context, float *constant);

/* log of the normal density of `action`, independent dimensions. */
float loss_log_prob(int actions, const float *action, const float *mean, const float *std);

#endif
