/* A minibatch's step: gradient of the loss, then the optimiser. */
#ifndef MILD_PPO_GRADIENT_H
#define MILD_PPO_GRADIENT_H

#include "learn/ppo_private.h"

/* Gradient of the loss over a minibatch into ppo->gradient (shard 0), its norm, and the sums. */
void ppo_gradient(Ppo *ppo, const LossContext *context, const PpoMinibatch *minibatch,
                  LossSums *sums, double *norm);
int ppo_largest_minibatch(const Ppo *ppo); /* [samples] */
/* Samples of a minibatch with these cuts that get a mirror image: how many, and with `which` not
 * NULL their places in the minibatch. */
int ppo_mirrored(const Ppo *ppo, const int *cut, int *which);
/* Random numbers for the sampled z: sample p of the minibatch uses the numbers from row[p] * latent
 * onward of this stream. row: [samples of the minibatch]. */
uint64_t ppo_latent_key(const Ppo *ppo, uint32_t draw);
void ppo_latent_rows(const int *cut, int *row);
/* One step of Adam along the gradient times gradient_scale; keeps the action noise above its floor.
 */
void ppo_optimise(Ppo *ppo, double gradient_scale);

#endif
