/* The learner's insides, shared by its files and their tests. */
#ifndef MILD_PPO_PRIVATE_H
#define MILD_PPO_PRIVATE_H

#include "learn/backend.h"
#include "learn/policy_private.h"
#include "learn/ppo.h"
#include "learn/safetensors.h"

/* A minibatch is cut into PPO_SHARDS equal runs of samples, each with its own gradient, and a shard
 * into chunks; sums go in the order of shards. None of this depends on the number of threads. */
#define PPO_SHARDS 8
#define PPO_CHUNK 256
#define PPO_RANGES 64 /* pieces of the parameter arrays in reduction and optimiser */
#define PPO_PIECES 64 /* pieces of the environments and samples in everything else */

struct Ppo {
    PpoDef def;
    Policy *policy;
    Pool *pool;
    PpoBackend backend; /* act NULL: the processor */
    MildError error;    /* of the backend; once set nothing more is learnt */
    PpoMirror mirror;   /* into mirror_block; observation_index NULL: none */
    int *mirror_index;
    float *mirror_sign;
    uint64_t seed;
    PpoBatch batch;
    int64_t iteration, adam_steps;
    double learning_rate;
    Policy *average; /* NULL: none */
    void *batch_block;
    size_t batch_bytes;
    float *gradient; /* [PPO_SHARDS][stride]; the sum ends in shard 0 */
    size_t stride;
    float *first, *second; /* Adam's moments */
    float *scratch;        /* [threads][scratch_floats] */
    size_t scratch_floats;
    int mirror_rows; /* images per full chunk */
    int *order;      /* [steps * envs] the valid samples, shuffled every epoch */
    int *draw;       /* [steps * envs] what the shuffle drew */
    int samples;     /* how many of them */
    size_t bytes;
};

/* Takes the backend over: ppo_destroy destroys it. */
void ppo_use(Ppo *ppo, const PpoBackend *backend);
static inline int ppo_piece_begin(int count, int piece) {
    return (int)((int64_t)count * piece / PPO_PIECES);
}

/* Generalised advantage estimation from batch->value; fills advantage (normalised over the valid
 * samples), returns, and ppo->order with the valid samples. */
void ppo_returns(Ppo *ppo, PpoReport *report);

/* Gradient of the loss over `count` samples into ppo->gradient (shard 0), its norm, and the sums.
 */
void ppo_gradient(Ppo *ppo, const LossContext *context, const int *samples, int count,
                  uint32_t draw, LossSums *sums, double *norm);
/* Samples of the minibatch that get a mirror image: how many, and with `which` not NULL their
 * places in the minibatch. */
int ppo_mirrored(const Ppo *ppo, int count, int *which);
/* The sampled z of the minibatch's sample p takes the numbers row[p] * latent .. of this stream:
 * [count] rows. */
uint64_t ppo_latent_key(const Ppo *ppo, uint32_t draw);
void ppo_latent_rows(int count, int *row);
void ppo_optimise(Ppo *ppo, double gradient_scale);

/* ppo_load from an open file; `path` names it in messages. */
MildStatus ppo_load_file(Ppo *ppo, const Safetensors *file, const char *path, void *extra,
                         size_t extra_size, MildError *error);

#endif
