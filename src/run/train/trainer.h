/* A training run in memory: robots, networks and learner of an experiment. The only files that it
 * knows are checkpoints. */
#ifndef TRAIN_TRAINER_H
#define TRAIN_TRAINER_H

#include "device/ranks/ranks.h"
#include "env/envs.h"
#include "learn/ppo.h"
#include "run/train/experiment.h"

typedef struct Trainer Trainer;

/* Wall time of one iteration [s], of this process. On a GPU `inference` and
 * `environments` do not separate the two: both only enqueue, and the wait for all of it is in
 * `environments`. */
typedef struct {
    double rollout, inference, environments, update;
    double physics, ground; /* thread time inside environments, summed over the threads; ground is
                               part of physics */
} TrainTimes;

typedef struct {
    PpoReport ppo;
    EnvsStats episodes;
    TrainTimes times;
    double steps_per_s;
    double reward_per_step; /* mean over the batch */
} TrainReport;

Trainer *train_create(const ExperimentDef *def, MildError *error);
/* One of several processes that train together: it has its part of train.envs (learn/order.h).
 * Borrows ranks (NULL: alone). This and the functions that can fail are calls of all ranks.
 * train_iterate may fail on one rank alone; the others agree. Reports are those of the whole. */
Trainer *train_create_part(const ExperimentDef *def, Ranks *ranks, MildError *error);
void train_destroy(Trainer *trainer);
/* One rollout and one update. Fails when train.device does. */
MildStatus train_iterate(Trainer *trainer, TrainReport *report, MildError *error);
int64_t train_iteration(const Trainer *trainer);
Policy *train_policy(Trainer *trainer); /* the policy to save; with ppo.average the mean weights */
size_t train_bytes(const Trainer *trainer); /* memory of environments, batch and learner */
int train_threads(const Trainer *trainer);

/* Saves all that resuming needs in one file with a checksum. Where MuJoCo steps the robots, a
 * resumed run equals one that was never stopped, bit for bit. Where the batch engine does, the file
 * holds the learner, the level of assistance of each robot and its clock (below 16 MiB with the
 * default networks), and the robots begin new episodes. Each reads the other's files. */
MildStatus train_save(Trainer *trainer, const char *path, const char *note, MildError *error);
MildStatus train_load(Trainer *trainer, const char *path, MildError *error);

#endif
