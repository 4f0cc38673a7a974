/* The state of a learner, for its files, its tests and the compute backends. */
#ifndef MILD_PPO_PRIVATE_H
#define MILD_PPO_PRIVATE_H

#include "base/pool.h"
#include "device/ranks/ranks.h"
#include "learn/optimiser.h"
#include "learn/order.h"
#include "learn/policy.h"
#include "learn/policy_private.h"
#include "learn/ppo_batch.h"
#include "learn/ppo_def.h"
#include "learn/safetensors.h"
#include "mild/error.h"

/* ---- backends ---- */

/* A compute backend is the learner on a device other than the CPU: networks, optimiser and
 * counters. It computes the same functions as ppo.c, from the same random numbers and equal up to
 * rounding, so a resumed run may change its device. The rollout is in the arrays of the batch,
 * which may be on the device too (ppo_is_resident).
 *
 * `self` is the first argument of every function. A function that fails gives the reason. */
typedef struct PpoBackend {
    void *self;
    /* As ppo_act. With a resident rollout it only enqueues work, and errors show in update. */
    MildStatus (*act)(void *self, int t, MildError *error);
    /* As ppo_update, without the rows that the next rollout begins with if they are on the CPU.
     * Sets the learner's counters and learning rate. */
    MildStatus (*update)(void *self, PpoReport *report, MildError *error);
    /* Parameters, moments, running mean of the weights and ppo->start from the device to the
     * learner, and back, with the counters, seed and learning rate. */
    MildStatus (*pull)(void *self, MildError *error);
    MildStatus (*push)(void *self, MildError *error);
    void (*destroy)(void *self);
} PpoBackend;

/* ---- the learner ---- */

/* A minibatch consists of ppo.shards runs of samples, each with its own gradient, and a shard is
 * cut into chunks. Sums are taken in the order of the shards. So no result depends on the number of
 * threads or processes. */
#define PPO_CHUNK 256
#define PPO_RANGES 64 /* pieces of the parameter arrays in reduction and optimiser */
#define PPO_PIECES 64 /* pieces of the environments and samples in everything else */

typedef struct Ppo {
    PpoDef def;
    Policy *policy;
    Pool *pool;
    PpoBackend backend; /* act NULL: the CPU */
    MildError error;    /* of the backend */
    PpoMirror mirror;   /* observation_index NULL: none */
    int *mirror_index;  /* [newest + actions] the arrays that `mirror` points to */
    float *mirror_sign; /* [newest + actions] */
    uint64_t seed;
    Ranks *ranks;   /* NULL: alone */
    OrderPart part; /* that this process has */
    PpoBatch batch; /* the rollout of its environments */
    PpoBatch start; /* on the CPU: its rows of time 0, with which a checkpoint's rollout begins */
    int resident;   /* bool: `batch` is on the device of the backend */
    int64_t iteration;
    int64_t adam_steps;
    double learning_rate;
    uint64_t hash;     /* of the parameters on the backend's device: see ppo_hash */
    Policy *average;   /* NULL: none */
    void *batch_block; /* memory of the arrays of `start`, and of `batch` unless it is resident */
    size_t batch_bytes;
    float *gradient;   /* [part.shards][stride]; the sum ends in the first */
    size_t stride;     /* [floats] of a shard's gradient */
    MuonMatrices muon; /* that Muon moves; count 0: Adam moves all */
    float *first;      /* [parameters] Adam's first moments, and the momentum of these matrices */
    float *second;     /* [parameters] Adam's second moments; 0 for these matrices */
    float *scratch;    /* [threads][scratch_floats] of a chunk, then of the optimiser */
    size_t scratch_floats;
    int mirror_rows; /* images per full chunk */
    float *noise;    /* [part.width][latent] of z, ppo.sample_latent; NULL: none */
    int *order;      /* [largest minibatch] this process's samples of the present minibatch */
    /* [steps * envs] The sample itself if it is usable, else the next usable one of its stratum. */
    int *substitute;
    int starved;  /* bool: a stratum has no usable sample, so this update takes no step */
    size_t bytes; /* held in all */
} Ppo;

/* Places the arrays of a rollout of b->steps x b->envs in the block, which is aligned to 64 bytes,
 * and returns its bytes. NULL: only counts them. */
size_t ppo_carve_batch(PpoBatch *b, const Network *network, void *block);
/* Moves the rollout to these arrays, which are the backend's. Frees its memory on the CPU but for
 * the rows of time 0. */
MildStatus ppo_move_rollout(Ppo *ppo, const PpoBatch *device, MildError *error);

/* First environment or sample of piece i. */
static inline int ppo_piece_begin(int count, int piece) {
    return (int)((int64_t)count * piece / PPO_PIECES);
}

/* Generalised advantage estimation (Schulman et al. 2016). From batch->value: fills advantage
 * (normalised over the usable samples), returns, and ppo->substitute and ppo->starved. A sample is
 * usable if it is valid and its reward and value are finite. */
void ppo_returns(Ppo *ppo, PpoReport *report);

/* ---- checkpoints from memory; ppo_save and ppo_load of ppo.h are the ones for users ---- */

/* ppo_load from an open file; `path` names it in messages. */
MildStatus ppo_load_file(Ppo *ppo, const Safetensors *file, const char *path, void *extra,
                         size_t extra_size, MildError *error);

#endif
