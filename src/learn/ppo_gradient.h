/* A minibatch's step: gradient of the loss, then the optimiser. */
#ifndef MILD_PPO_GRADIENT_H
#define MILD_PPO_GRADIENT_H

#include "learn/loss.h"
#include "learn/order.h"
#include "learn/ppo_private.h"

/* Samples of the rollout in runs, one for each shard (learn/order.h). Shards may be empty. */
typedef struct {
    const int *samples; /* [cut[PPO_SHARDS_MAX]] places in the rollout; with several processes
                                (ranks/ranks.h) the shards of this one alone, without the others' */
    int cut[PPO_SHARDS_MAX +
            1];    /* shard s is samples[cut[s]] .. samples[cut[s + 1] - 1]; cut[0] = 0 */
    uint32_t draw; /* number in this update, which picks the random numbers */
} PpoMinibatch;

/* Gradient of the loss over a minibatch into ppo->gradient (the first shard's), its norm, and the
 * sums. */
void ppo_gradient(Ppo *ppo, const LossContext *context, const PpoMinibatch *minibatch,
                  LossSums *sums, double *norm);
/* Samples of these cuts (of a minibatch, or order_own_cuts) that get a mirror image: how many, and
 * with `which` not NULL their places. */
int ppo_mirrored(const Ppo *ppo, const int *cut, int *which);
/* Random numbers for the sampled z: sample p of the cuts uses the numbers from row[p] * latent
 * onward of the stream step_latent_key. first: place of sample 0 in the whole minibatch, which is
 * above 0 for order_own_cuts. row: [samples of the cuts]. */
void ppo_latent_rows(const int *cut, int first, int *row);
/* One step of the optimiser along the gradient times gradient_scale, which it may overwrite; keeps
 * the action noise above its floor. */
void ppo_optimise(Ppo *ppo, double gradient_scale);

#endif
