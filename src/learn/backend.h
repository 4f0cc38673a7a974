/* A compute backend runs the learner's networks on a device other than the CPU. It computes the
 * same functions as policy_act, policy_value and ppo_gradient, from the same random numbers and
 * equal up to rounding. Optimiser, advantages, order of the samples and checkpoints
 * stay with the learner, so a resumed run may change its device. */
#ifndef MILD_BACKEND_H
#define MILD_BACKEND_H

#include "learn/loss.h"
#include "learn/order.h"

/* Samples of the rollout in runs, one for each shard (learn/order.h). Shards may be empty. */
typedef struct {
    const int *samples;      /* [cut[PPO_SHARDS]] places in the rollout; with several processes
                                (ranks/ranks.h) the shards of this one alone, without the others' */
    int cut[PPO_SHARDS + 1]; /* shard s is samples[cut[s]] .. samples[cut[s + 1] - 1]; cut[0] = 0 */
    uint32_t draw;           /* number in this update, which picks the random numbers */
} PpoMinibatch;

/* `self` is the first argument of every function. A function that fails gives the reason and may
 * leave its results unwritten. */
typedef struct PpoBackend {
    void *self;
    /* batch->mean at time t from batch->history at time t. */
    MildStatus (*act)(void *self, int t, MildError *error);
    /* batch->value from batch->critic. The rollout is complete. Until the next act() the learner
     * changes only the parameters and the batch's advantage and returns. */
    MildStatus (*values)(void *self, MildError *error);
    /* Gradient of the loss over the minibatch into gradient [parameters], and the sums. */
    MildStatus (*gradient)(void *self, const LossContext *context, const PpoMinibatch *minibatch,
                           float *gradient, LossSums *sums, MildError *error);
    void (*destroy)(void *self);
} PpoBackend;

#endif
