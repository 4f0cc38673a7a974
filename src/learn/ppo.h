/* Proximal policy optimisation (Schulman et al. 2017) with asymmetric critic, joint VAE loss (paper
 * eqs 16-17), mirror loss and KL-adapted learning rate. Loss = epsilon*loss_reg +
 * (1-epsilon)*(surrogate + value + entropy) + mirror. */
#ifndef MILD_PPO_H
#define MILD_PPO_H

#include "device/ranks/ranks.h"
#include "learn/policy.h"
#include "learn/ppo_batch.h"
#include "learn/ppo_def.h"

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
/* Computes on another device from now on (PpoBackend, ppo_private.h). Takes ownership of the
 * backend, which ppo_destroy destroys. */
struct PpoBackend;
void ppo_use(Ppo *ppo, const struct PpoBackend *backend);
/* The rollout. Its arrays are on the backend's device if ppo_is_resident, else on the CPU. The
 * caller writes the rows of time 0 of the first rollout, and those of time t + 1 after act(t). */
PpoBatch *ppo_batch(Ppo *ppo);
int ppo_is_resident(const Ppo *ppo);
/* Places arrays of the rollout's shape in a block that is aligned to 64 bytes, and returns their
 * bytes. NULL: only counts them. */
size_t ppo_batch_like(const Ppo *ppo, void *block, PpoBatch *batch);
size_t ppo_bytes(const Ppo *ppo); /* memory held */
/* Fills batch->action/mean/log_prob at time t from batch->history[t]; noise is a function of (seed,
 * iteration, t, env). With a resident rollout it only enqueues work on the backend's stream. */
void ppo_act(Ppo *ppo, int t);
/* Computes values and advantages, runs the epochs of minibatches, moves the rows of time `steps` to
 * time 0 for the next rollout, and increments the iteration. On a device the parameters of the
 * policy on the CPU stay as they were: see ppo_pull. */
void ppo_update(Ppo *ppo, PpoReport *report);
int64_t ppo_iteration(const Ppo *ppo);
/* Brings policy, running mean and the rows of time 0 on the CPU up to date with the device.
 * ppo_save and ppo_average do it themselves. Nothing to do without a backend. */
MildStatus ppo_pull(Ppo *ppo, MildError *error);
/* Hash of the parameters after the last update. On a device only several processes have it. */
uint64_t ppo_hash(const Ppo *ppo);
/* The running mean of the weights (Polyak and Juditsky 1992), or the policy itself with def.average
 * = 0. Owned by ppo. */
Policy *ppo_average(Ppo *ppo);
/* The error that stopped the compute backend, if any. The parameters on the CPU are those of the
 * last ppo_pull. */
MildStatus ppo_status(const Ppo *ppo, MildError *error);

/* Saves everything that resuming needs: parameters, moments, learning rate, counters, and a block
 * of the caller (the state of the environments). It is one safetensors file with a CRC-32, written
 * completely or not at all. Loading changes nothing unless the whole file is valid. extra_size must
 * match on load. */
MildStatus ppo_save(const Ppo *ppo, const char *path, const void *extra, size_t extra_size,
                    const char *note, MildError *error);
MildStatus ppo_load(Ppo *ppo, const char *path, void *extra, size_t extra_size, MildError *error);
/* The same without the rows of time 0, for environments that begin new episodes when a run goes on.
 * ppo_load_learner reads files of both kinds. found: bool, whether `kept` was read, which it is
 * from a file of ppo_save_learner with as many bytes. */
MildStatus ppo_save_learner(const Ppo *ppo, const char *path, const void *kept, size_t kept_size,
                            const char *note, MildError *error);
MildStatus ppo_load_learner(Ppo *ppo, const char *path, void *kept, size_t kept_size, int *found,
                            MildError *error);
/* *whole: bool, the file is ppo_save's, not ppo_save_learner's. Fails where it cannot be read. */
MildStatus ppo_file_is_whole(const char *path, int *whole, MildError *error);

#endif
