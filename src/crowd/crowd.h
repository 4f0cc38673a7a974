/* Environments of the task on a GPU, or on the CPU by the same text: robots stepped by the batch
 * engine (docs/engine.md) on the batch ground (mild/batch.h), the task by its own files (src/task).
 * The same observations, rewards and random numbers as those of Vec, within the rounding of float.
 *
 * One thread and one stream at a time. On a GPU, crowd_reset and crowd_step only put work into the
 * stream, so that a graph may capture them. */
#ifndef MILD_CROWD_H
#define MILD_CROWD_H

#include <stdint.h>

#include "base/pool.h"
#include "crowd/trial.h"
#include "task/vec.h"

typedef struct Crowd Crowd;

typedef struct {
    const TaskDef *task; /* copied */
    const Robot *robot;  /* read during the call */
    Pool *pool;          /* draws the grounds */
    int device;          /* a CUDA device, or MILD_BATCH_HOST */
    int envs;            /* environments */
    uint32_t first;      /* number of the first one, which selects its random numbers */
    int grounds;         /* drawn beforehand; episodes choose among them */
    uint64_t seed;
    int striped; /* bool: the labels of task->map are stripes, which only the share patch_share of
                    the soft episodes has; the others are uniform */
    const TaskGrounds *chosen; /* copied; NULL: `grounds` are drawn */
    const CrowdTrial *trial;   /* [envs] copied; NULL: episodes draw their ground and command */
} CrowdDef;

/* NULL, with one line in *error, for what the device does not have yet (imprints, blended borders,
 * patches other than stripes of a map), and when device or memory is missing. */
Crowd *crowd_create(const CrowdDef *def, MildError *error);
void crowd_destroy(Crowd *crowd); /* may be NULL */
/* Bool: on a GPU this build has no kernels of the robot's own size, and those for any robot,
 * several times slower, step it. */
int crowd_is_slow(const Robot *robot);

/* As vec_reset and vec_step; arrays in the memory of the device, the history not NULL. stream: a
 * cudaStream_t. */
MildStatus crowd_reset(Crowd *crowd, const VecView *first, void *stream, MildError *error);
MildStatus crowd_step(Crowd *crowd, const float *action, float *reward, uint8_t *done,
                      uint8_t *timeout, uint8_t *valid, const VecView *next, void *stream,
                      MildError *error);
/* As vec_take_sums. Waits for the device. */
MildStatus crowd_take_sums(Crowd *crowd, VecStats *sums, void *stream, MildError *error);
/* [B] Of the device for one robot. */
typedef struct {
    size_t task;   /* TaskEnv and the frames of its history */
    size_t engine; /* between the parts of a step, and what the task reads of it */
    size_t ground; /* of mild/batch.h */
    size_t rest;   /* what passes between engine and ground; shares of model, task and grounds */
} CrowdMemory;
CrowdMemory crowd_memory(const Crowd *crowd);
/* Their sum. */
size_t crowd_robot_bytes(const Crowd *crowd);
/* What lasts beyond an episode, [envs] on the host, and back, before crowd_reset. Waits for the
 * device. */
MildStatus crowd_keep(Crowd *crowd, TaskKept *kept, MildError *error);
MildStatus crowd_restore(Crowd *crowd, const TaskKept *kept, MildError *error);
/* With CrowdDef.trial. Commands from the next policy step on, [envs][3] on the host, see
 * TaskEnv.command; the first ones before crowd_reset. Waits for the device. */
MildStatus crowd_command(Crowd *crowd, const double *command, MildError *error);
/* From now on the physics steps of each policy step are written to `sample`,
 * [envs][crowd_samples] in the memory of the device; NULL: no longer. */
void crowd_watch(Crowd *crowd, CrowdSample *sample);
int crowd_samples(const Crowd *crowd); /* physics steps of a policy step */
size_t crowd_bytes(const Crowd *crowd);
/* The TaskEnv of an environment as a device has it (task/place.h), on the host only: for tests. */
void *crowd_env(const Crowd *crowd, int i);

#endif
