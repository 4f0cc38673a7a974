/* Generalised advantage estimation (Schulman et al. 2016). */
#ifndef MILD_PPO_RETURNS_H
#define MILD_PPO_RETURNS_H

#include "learn/ppo_private.h"

/* From batch->value: fills advantage (normalised over the usable samples), returns, and
 * ppo->substitute and ppo->starved. A sample is usable if it is valid and its reward and value are
 * finite. */
void ppo_returns(Ppo *ppo, PpoReport *report);

#endif
