/* Generalised advantage estimation (Schulman et al. 2016). */
#ifndef MILD_PPO_RETURNS_H
#define MILD_PPO_RETURNS_H

#include "learn/ppo_private.h"

/* From batch->value: fills advantage (normalised over the valid samples), returns, and ppo->order
 * with the valid samples. */
void ppo_returns(Ppo *ppo, PpoReport *report);

#endif
