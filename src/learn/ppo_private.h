/* What a learner holds, for its files, their tests and the compute backends. */
#ifndef MILD_PPO_PRIVATE_H
#define MILD_PPO_PRIVATE_H

#include "base/pool.h"
#include "learn/backend.h"
#include "learn/policy.h"
#include "learn/policy_private.h"
#include "learn/ppo_batch.h"
#include "learn/ppo_def.h"

/* A minibatch is cut into PPO_SHARDS equal runs of samples, each with its own gradient, and a shard
 * into chunks; sums go in the order of shards. None of this depends on the number of threads. */
#define PPO_SHARDS 8
#define PPO_CHUNK 256
#define PPO_RANGES 64 /* pieces of the parameter arrays in reduction and optimiser */
#define PPO_PIECES 64 /* pieces of the environments and samples in everything else */

typedef struct Ppo {
    PpoDef def;
    Policy *policy;
    Pool *pool;
    PpoBackend backend; /* act NULL: the processor */
    MildError error;    /* of the backend; once set nothing more is learnt */
    PpoMirror
        mirror; /* its arrays are mirror_index and mirror_sign; observation_index NULL: none */
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
} Ppo;

/* Piece i of so many environments or samples begins here. */
static inline int ppo_piece_begin(int count, int piece) {
    return (int)((int64_t)count * piece / PPO_PIECES);
}

#endif
