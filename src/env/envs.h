/* Vectorised environments: many robots on the task (src/env/task), stepped together. Training,
 * evaluation, bench, Python and other learners use this and nothing below it. One of two backends
 * steps the robots (backend.h): MuJoCo on the CPU, or the batch engine (docs/engine.md) on a GPU or
 * the CPU. Both draw the same random numbers and give the same observations and rewards, the batch
 * engine's within the rounding of float.
 *
 *     Envs *envs = envs_create(&def, &error);
 *     envs_reset(envs, &view, stream, &error);
 *     for (;;) { ... actions ...; envs_step(envs, &step, stream, &error); }
 *     envs_destroy(envs);
 *
 * Arrays are where the environments are: on the CPU, or in the memory of the device. On a GPU reset
 * and step only put work into the stream (a cudaStream_t; NULL: the default one), so that a graph
 * may capture them. One thread and one stream at a time. */
#ifndef ENVS_H
#define ENVS_H

#include <stddef.h>

#include "base/pool.h"
#include "env/envs_step.h"
#include "env/task/ground.h"
#include "env/task/state.h"
#include "env/trial.h"
#include "robot/robot.h"

typedef struct Envs Envs;

/* Torques in the place of the joints' PD in environment i, at the start of each physics step; see
 * TaskDrive. NULL: none. */
typedef struct {
    void (*torque)(void *self, int i, const TaskEnv *env, RobotSim *sim, double *torque);
    void *self;
} EnvsDrive;

typedef struct {
    const TaskDef *task; /* copied; its map and motors are borrowed */
    const Robot *robot;  /* borrowed */
    Pool *pool;          /* borrowed; threads of the CPU */
    int count;           /* environments */
    uint32_t first;      /* number of the first one, which selects its random numbers */
    uint64_t seed;
    int batch; /* bool: the batch engine steps the robots; else MuJoCo */
    /* of the batch engine */
    int device;  /* a CUDA device, or MILD_BATCH_HOST */
    int grounds; /* drawn beforehand; episodes choose among them. Not with trials */
    int striped; /* bool: the labels of task->map are stripes, which only the share patch_share of
                    the soft episodes has; the others are uniform */
    /* of both again: trials of an evaluation */
    const EnvsTrial *trial;     /* [count] borrowed; NULL: episodes draw their ground and command */
    const MildTerrain *terrain; /* [terrains] borrowed; of the trials, all with task->map */
    int terrains;
    EnvsDrive drive; /* by MuJoCo */
    /* [count] by MuJoCo, borrowed: who computes the soft ground; NULL: libmild */
    const RobotGround *ground;
} EnvsDef;

/* NULL, with one line in *error, for what the batch engine does not have (imprints, blended
 * borders, patches other than stripes of a map), and when device or memory is missing. */
Envs *envs_create(const EnvsDef *def, MildError *error);
void envs_destroy(Envs *envs); /* may be NULL */

/* New episodes in all environments, and their first observations. */
MildStatus envs_reset(Envs *envs, const EnvsView *first, MildStream stream, MildError *error);
/* A policy step of all environments. */
MildStatus envs_step(Envs *envs, const EnvsStep *step, MildStream stream, MildError *error);
/* Until the steps are done. */
MildStatus envs_wait(Envs *envs, MildError *error);

/* Sums over the episodes that ended since the last call (`assist`: over the robots), which may be
 * added to those of other Envs, and the means from them. Waits for the device. count: environments
 * of all. */
MildStatus envs_sums(Envs *envs, EnvsStats *sums, MildStream stream, MildError *error);
EnvsStats envs_means(EnvsStats sums, int count);
/* [s] Thread time in physics since the last call, and the ground's part of it; 0 for the batch
 * engine. */
void envs_times(Envs *envs, double *physics, double *ground);

/* ---- save and fork: of the batch engine ---- */

/* A block is all that decides what an environment does next, its random numbers aside: robot,
 * ground under it, task. It is in the memory of the device, and fits all Envs whose definitions
 * differ in nothing but count, first and physics_dt, and with own_ground in seed and randomize.
 *
 * Bytes of a block; with own_ground (bool) of the part that envs_fork reads. */
size_t envs_block_bytes(const Envs *envs, int own_ground);
/* `count` environments from `first` on to as many blocks. On a GPU it only puts work into the
 * stream, as envs_fork does. */
MildStatus envs_save(Envs *envs, int first, int count, void *blocks, MildStream stream,
                     MildError *error);
/* `count` blocks of `bytes` each to all environments: the first block to the first of `count` equal
 * groups of them, and so on. Each environment keeps its seed, its number and its count of steps, so
 * that without noise and pushes all of a group do the same under the same actions.
 *
 * own_ground: bool, each also keeps its ground, rigid or soft, level and of one material. Where
 * both are soft, the robot and its prints are moved up or down together until the feet bear at rest
 * what they bore; on the same ground nothing moves. Where one is rigid, and at the start of an
 * episode, the ground forgets the feet, and the lowest sole becomes as deep as one that stands
 * there. */
MildStatus envs_fork(Envs *envs, const void *blocks, int count, size_t bytes, int own_ground,
                     MildStream stream, MildError *error);

/* Where the robots are. Of the batch engine. */
MildStatus envs_read(Envs *envs, const EnvsMotion *motion, MildStream stream, MildError *error);

/* Everything that persists, as one block without pointers, so that saving and loading are copies;
 * NULL for the batch engine. */
char *envs_state(Envs *envs, size_t *bytes);
/* What lasts beyond an episode, [count] on the CPU, and back, before envs_reset. Waits for the
 * device. */
MildStatus envs_save_progress(Envs *envs, TaskProgress *progress, MildError *error);
MildStatus envs_load_progress(Envs *envs, const TaskProgress *progress, MildError *error);

/* [B] Of one robot. */
typedef struct {
    size_t task;   /* its TaskEnv, frames and poses; for MuJoCo also its ground */
    size_t engine; /* between the parts of a step, and what the task reads of it */
    size_t ground; /* of mild/batch.h */
    size_t rest;   /* what passes between engine and ground; shares of model, task and grounds */
} EnvsMemory;
EnvsMemory envs_memory(const Envs *envs);
size_t envs_robot_bytes(const Envs *envs); /* their sum */
size_t envs_bytes(const Envs *envs);       /* of all */

/* ---- trials ---- */

/* With EnvsDef.trial. The first episode of an environment is its trial; what follows its end is
 * left to the backend. Commands from the next policy step on, [count][TASK_COMMANDS] on the CPU;
 * the first ones before envs_reset. Waits for the device. */
MildStatus envs_set_commands(Envs *envs, const double *command, MildError *error);
/* From now on the physics steps of each policy step are written to `sample`,
 * [count][envs_physics_steps] in the memory of the device; NULL: no longer. */
void envs_set_samples(Envs *envs, EnvsSample *sample);
int envs_physics_steps(const Envs *envs); /* of a policy step */

/* What MuJoCo's robot did in the physics step that `sim` has just made. */
void envs_read_sample(const TaskEnv *env, const RobotSim *sim, const double *torque,
                      EnvsSample *sample);
/* One environment of MuJoCo; NULL for the batch engine. */
TaskEnv *envs_env(Envs *envs, int i);

/* Bool: on a GPU this build has no kernels of the robot's own size, and those for any robot,
 * several times slower, step it. */
int envs_are_slow(const Robot *robot);

#endif
