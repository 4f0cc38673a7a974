/* The environments of a run: robots stepped by MuJoCo on the CPU (Vec) or by the batch engine where
 * the networks run (Crowd). */
#ifndef TRAIN_ENVS_H
#define TRAIN_ENVS_H

#include "learn/ppo.h"
#include "task/vec.h"
#include "train/experiment.h"

typedef struct TrainEnvs TrainEnvs;

/* The map of the terrain, which the caller sets in def->task.map and destroys after the
 * environments; NULL for level ground. striped: written, see CrowdDef. */
MildStatus train_make_map(const ExperimentDef *def, MildMap **map, int *striped, MildError *error);

/* count: of this process, with numbers from `first`. striped: see CrowdDef. */
TrainEnvs *train_envs_create(const ExperimentDef *def, int striped, const Robot *robot, Pool *pool,
                             int count, int first, MildError *error);
void train_envs_destroy(TrainEnvs *envs); /* may be NULL */
/* New episodes; their observations to the rows of time 0. stream: of the learner, see
 * gpu_learner_stream. */
MildStatus train_envs_reset(TrainEnvs *envs, PpoBatch *batch, void *stream, MildError *error);
/* A policy step from time t, with the batch's actions. */
MildStatus train_envs_step(TrainEnvs *envs, PpoBatch *batch, int t, void *stream, MildError *error);
/* The same into arrays of the caller, where the environments are: rows [envs], see vec_step. */
MildStatus train_envs_reset_into(TrainEnvs *envs, const VecView *first, void *stream,
                                 MildError *error);
MildStatus train_envs_step_into(TrainEnvs *envs, const float *action, float *reward, uint8_t *done,
                                uint8_t *timeout, uint8_t *valid, const VecView *next, void *stream,
                                MildError *error);
/* As vec_watch_ends. Fails for the batch engine. */
MildStatus train_envs_watch_ends(TrainEnvs *envs, const VecView *last, float *terms,
                                 MildError *error);
/* Until the steps are done. */
MildStatus train_envs_wait(const TrainEnvs *envs, MildError *error);
/* As vec_take_sums and vec_take_times. */
MildStatus train_envs_take_sums(TrainEnvs *envs, VecStats *sums, void *stream, MildError *error);
void train_envs_take_times(TrainEnvs *envs, double *physics, double *ground);
size_t train_envs_bytes(const TrainEnvs *envs);
/* The whole state, which resumes with the same bits; NULL for the batch engine. */
void *train_envs_state(TrainEnvs *envs, size_t *bytes);
/* What lasts beyond an episode [envs], and back, before train_envs_reset. */
MildStatus train_envs_keep(TrainEnvs *envs, TaskKept *kept, MildError *error);
MildStatus train_envs_restore(TrainEnvs *envs, const TaskKept *kept, MildError *error);

#endif
