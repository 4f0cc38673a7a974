/* Loss and gradient of one chunk of samples. Two independent halves: the actor's (encoder,
 * modulation, actor, decoder, log std) and the critic's.
 *
 *   L = (1-eps) (surrogate - w_H entropy + w_V value) + eps (recon + phi sum max(KL_i, free_bits) +
 * sum over groups MSE) + w_M mirror   (eq 16)
 *
 * recon = MSE(frame) + MSE(ground), the parts of the decoder's output (PpoTarget).
 * Means are over the minibatch. The caller gives 1 / (its samples), so the results of chunks and
 * shards add up. */
#ifndef MILD_LOSS_H
#define MILD_LOSS_H

#include "learn/loss_sample.h"
#include "learn/network.h"
#include "learn/ppo_def.h"

/* Constants of one minibatch. */
typedef struct {
    const PpoDef *def;
    const Network *network;
    const PpoMirror *mirror; /* NULL: none */
    const float *parameters;
    float sample_weight;                /* 1 / samples in the minibatch */
    float mirror_weight;                /* 1 / samples of the minibatch that the mirror loss sees */
    float std[NETWORK_ACTIONS_MAX];     /* [-] of the action noise now */
    float old_std[NETWORK_ACTIONS_MAX]; /* [-] in the rollout */
} LossContext;

/* One chunk of `rows` samples. After them history holds `mirrored` more rows: the mirror images
 * of the first samples. */
typedef struct {
    int rows;
    int mirrored;
    /* input */
    float *history;        /* [rows + mirrored][history] */
    float *estimate;       /* [rows][estimates] target */
    float *decoder_target; /* [rows][decoded] frame, then parameters of the ground */
    /* [rows + mirrored][latent] standard normal, for the sampled z. outputs.noise is NULL, or these
     * are the actor's too; otherwise those of the images have no meaning. */
    float *noise;
    float *action;       /* [rows][actions] */
    float *old_mean;     /* [rows][actions] */
    float *old_log_prob; /* [rows] */
    float *advantage;    /* [rows] */
    float *critic;       /* [rows][critic_input] */
    float *old_value;    /* [rows] */
    float *returns;      /* [rows] */
    /* forward */
    NetworkOutputs outputs;
    MlpOutputs decoder;
    MlpOutputs value;
    float *decoder_input; /* [rows][decoder_input] */
    float *spread;        /* [rows][latent] exp(logvar / 2) */
    /* gradients with respect to the array named after d_ */
    float *d_mean;          /* [rows + mirrored][actions] */
    float *d_heads;         /* [rows + mirrored][heads] */
    float *d_theta;         /* [rows + mirrored][theta] */
    float *d_actor_input;   /* [rows + mirrored][estimates + latent] the part after the frame */
    float *d_feet;          /* [rows + mirrored][feet] of the modulation's estimates */
    float *d_decoded;       /* [rows][decoded] */
    float *d_decoder_input; /* [rows][decoder_input] */
    float *d_value;         /* [rows] */
    float *work[2];         /* [rows + mirrored][widest layer] each */
} LossChunk;

/* Places a chunk for at most `rows` samples and `mirrored` images in the block and returns its
 * floats. NULL: only counts them. */
size_t loss_carve(const Network *network, int rows, int mirrored, float *block, LossChunk *chunk);
/* Copies row `from` of the chunk's history, mirrored, to row `to`. */
void loss_mirror_row(const LossContext *context, LossChunk *chunk, int from, int to);

/* Add to the sums and to the gradient's ranges of their half (beta 0 overwrites instead). */
void loss_actor(const LossContext *context, LossChunk *chunk, float *gradient, float beta,
                LossSums *sums);
void loss_critic(const LossContext *context, LossChunk *chunk, float *gradient, float beta,
                 LossSums *sums);

#endif
