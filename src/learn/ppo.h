/* Proximal policy optimisation (Schulman et al. 2017) with asymmetric critic, joint VAE loss (paper
 * eqs 16-17), mirror loss and KL-adapted learning rate. Loss = epsilon*loss_reg +
 * (1-epsilon)*(surrogate + value + entropy) + mirror. */
#ifndef MILD_PPO_H
#define MILD_PPO_H

#include "learn/policy.h"
#include "learn/ppo_batch.h"
#include "learn/ppo_def.h"
#include "ranks/ranks.h"

typedef struct Ppo Ppo;
/* Borrows policy and pool. mirror: NULL for none; it is copied. */
Ppo *ppo_create(const PpoDef *def, Policy *policy, Pool *pool, const PpoMirror *mirror, int envs,
                uint64_t seed, MildError *error);
/* One of several processes that train together; borrows ranks (NULL: alone). envs: of all of them.
 * The batch has this process's part, environments ppo_first_env onward. ppo_update, ppo_save and
 * ppo_load then are calls of all ranks, whose parameters are always the same. */
Ppo *ppo_create_part(const PpoDef *def, Policy *policy, Pool *pool, const PpoMirror *mirror,
                     int envs, uint64_t seed, Ranks *ranks, MildError *error);
void ppo_destroy(Ppo *ppo);
int ppo_first_env(const Ppo *ppo);
/* Computes on another device from now on (learn/backend.h). Takes ownership of the backend, which
 * ppo_destroy destroys. */
struct PpoBackend;
void ppo_use(Ppo *ppo, const struct PpoBackend *backend);
PpoBatch *ppo_batch(Ppo *ppo);
size_t ppo_bytes(const Ppo *ppo); /* memory held */
/* Fills batch->action/mean/log_prob at time t from batch->history[t]; noise is a function of (seed,
 * iteration, t, env). */
void ppo_act(Ppo *ppo, int t);
/* Computes values and advantages, runs the epochs of minibatches, moves the rows of time `steps` to
 * time 0 for the next rollout, and increments the iteration. */
void ppo_update(Ppo *ppo, PpoReport *report);
int64_t ppo_iteration(const Ppo *ppo);
/* The running mean of the weights (Polyak and Juditsky 1992), or the policy itself with def.average
 * = 0. Owned by ppo. */
Policy *ppo_average(Ppo *ppo);
/* The error that stopped the compute backend, if any. The parameters are those of the last step
 * that succeeded. */
MildStatus ppo_status(const Ppo *ppo, MildError *error);

/* Saves everything that resuming needs: parameters, moments, learning rate, counters, and a block
 * of the caller (the state of the environments). It is one safetensors file with a CRC-32, written
 * completely or not at all. Loading changes nothing unless the whole file is valid. extra_size must
 * match on load. */
MildStatus ppo_save(const Ppo *ppo, const char *path, const void *extra, size_t extra_size,
                    const char *note, MildError *error);
MildStatus ppo_load(Ppo *ppo, const char *path, void *extra, size_t extra_size, MildError *error);

#endif
