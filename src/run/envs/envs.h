/* Environments for other learners: the task of `mild train` (docs/task.md) behind a C interface,
 * which the shared library mild_envs exports. A learner opens many environments at once, hands over
 * arrays of its own, and steps them:
 *
 *     MildEnvs *envs = mild_envs_open("configs/walk.ini", overrides, count, &error);
 *     mild_envs_reset(envs, &view, stream, &error);
 *     for (;;) { ... actions ...; mild_envs_step(envs, &step, stream, &error); }
 *     mild_envs_close(envs);
 *
 * Everything is a key of the config: train.envs their number, train.device where they are and where
 * the arrays must be, train.robots what steps them, train.seed, train.robot, train.threads.
 * Environments that ended begin a new episode in the same step, whose first observation is the one
 * written.
 *
 * On a CUDA device arrays are in its memory, and reset and step only put work into the stream (a
 * cudaStream_t; NULL: the default one), so a graph may capture them. On the CPU they return when
 * the work is done.
 *
 * Thread safety: environments belong to one thread at a time, and on a GPU to one stream. Several
 * may be open at once. Where MuJoCo steps the robots, its log handler is set for the process. */
#ifndef MILD_ENVS_H
#define MILD_ENVS_H

#include <stddef.h>

#include "env/envs_step.h"
#include "mild/error.h"

MILD_API_BEGIN

/* Open environments; see mild_envs_open. */
typedef struct MildEnvs MildEnvs;

/* Their number, and the widths of the arrays. */
typedef struct {
    int envs;        /* environments */
    int actions;     /* of each, one per joint */
    int observation; /* numbers of a frame, docs/policy.md section 3 */
    int frames;      /* of a history: means of older frames, the newest frame last */
    int critic;      /* numbers of what only a critic may see */
    int estimates;   /* numbers of true velocities and heights, which an estimator regresses on */
    int rewards;     /* terms of the reward */
    int device;      /* CUDA device that the arrays are on; -1: the CPU */
    double period;   /* [s] policy step */
    double episode;  /* [s] longest episode; the first ones are shorter */
    double clip;     /* [-] actions are clipped to -clip .. clip */
} MildEnvsShape;

/* config: a file over configs/default.ini, or NULL. overrides: [count] "section.key=value". Their
 * data are found under $MILD_HOME, or where the library was built. Returns NULL with one line in
 * *error. */
MildEnvs *mild_envs_open(const char *config, const char *const *overrides, int count,
                         MildError *error);
/* May be NULL. Wait for the stream before. */
void mild_envs_close(MildEnvs *envs);

/* Numbers that fit the arrays. */
MildEnvsShape mild_envs_shape(const MildEnvs *envs);

/* Name of a term of the reward; 0 <= index < MildEnvsShape.rewards. */
const char *mild_envs_reward_name(int index);

/* Mirror image left to right of a frame and of an action: o'_i = sign_i o_index_i. Arrays of the
 * caller on the CPU: [observation] and [actions]. */
void mild_envs_mirror(const MildEnvs *envs, int *observation_index, float *observation_sign,
                      int *action_index, float *action_sign);

/* What a policy's file says of where it walks (docs/policy.md): the robot's name, and the keys of
 * [task] that decide what it sees and what becomes of its actions, "gait_period = 0.8; ...". */
const char *mild_envs_robot(const MildEnvs *envs);
const char *mild_envs_task(const MildEnvs *envs);

/* The robot's MJCF, to draw it, and how one robot lies in an mjData of that file: qpos[size] [m, -,
 * rad]. Returns how many numbers it has; 0 where the batch engine steps the robots. 0 <= index <
 * MildEnvsShape.envs. */
const char *mild_envs_model(const MildEnvs *envs);
int mild_envs_pose(const MildEnvs *envs, int index, double *qpos, int size);

/* New episodes in all environments, and their first observations. */
MildStatus mild_envs_reset(MildEnvs *envs, const EnvsView *first, MildStream stream,
                           MildError *error);

/* A policy step of all environments. */
MildStatus mild_envs_step(MildEnvs *envs, const EnvsStep *step, MildStream stream,
                          MildError *error);

/* Save and fork, where the batch engine steps the robots (train.robots = batch), e.g. to plan:
 * `count` environments from `first` on are saved to as many blocks, and these put into all
 * environments, a block into each of `count` equal groups, of these or of others opened with the
 * same keys but train.envs and task.physics_dt (and train.seed, if it draws the same grounds).
 * Without noise and pushes all of a group then do the same under the same actions. Blocks are the
 * caller's, on the device, at a multiple of 16, each of mild_envs_block_bytes of the environments
 * that wrote it; on a GPU these functions only put work into the stream.
 *
 * own_ground: bool, each environment keeps its ground, level and of one material: what another one
 * is believed to be. Where both are soft, the robot and its prints are moved up or down together
 * until the feet bear at rest what they bore; where one is rigid, and at the start of an episode,
 * prints go and the robot is set down as deep as it stands. Then train.seed and the section
 * randomize may differ, too. */
size_t mild_envs_block_bytes(const MildEnvs *envs, int own_ground);
MildStatus mild_envs_save(MildEnvs *envs, int first, int count, void *blocks, MildStream stream,
                          MildError *error);
MildStatus mild_envs_fork(MildEnvs *envs, const void *blocks, int count, size_t bytes,
                          int own_ground, MildStream stream, MildError *error);
/* Where the robots are and how they move; where the batch engine steps them. */
MildStatus mild_envs_read(MildEnvs *envs, const EnvsMotion *motion, MildStream stream,
                          MildError *error);

/* Means over the episodes that ended since the last call. Waits for the device. */
MildStatus mild_envs_stats(MildEnvs *envs, EnvsStats *stats, MildStream stream, MildError *error);

MILD_API_END

#endif
