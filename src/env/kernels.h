/* What steps an environment of the batch engine: on the CPU batch_host.c, on a GPU
 * batch_device.cu. */
#ifndef ENV_KERNELS_H
#define ENV_KERNELS_H

#include "env/batch_arrays.h"
#include "env/envs.h"

enum { ENVS_ROWS_MAX = 24 };

/* Between an environment of each row's array and a block. */
typedef struct {
    char *block;    /* the first */
    size_t stride;  /* [B] from block to block */
    long first;     /* environment of the first block */
    int group;      /* environments that have a block in common */
    int own_ground; /* bool: see envs_fork */
    int count;      /* of rows */
    struct {
        char *at; /* of environment 0 */
        size_t bytes;
        size_t place; /* [B] in the block */
    } row[ENVS_ROWS_MAX];
    size_t rest;      /* [B] in the block: what feet bear at rest, see batch_fork.h */
    BatchShape shape; /* of the feet's ground */
    BatchArrays ground;
} EnvsFork;

#define ENVS_MODEL_NUMBERS ((int)(sizeof(EngineNumbers) / sizeof(Real)))

/* [B] of an environment in EnvsArrays, by the code of the CPU or of a device, which may be
 * compiled for one robot. */
typedef struct {
    size_t stride;
    size_t robot;
    size_t shells;
} EnvsBytes;
EnvsBytes envs_host_bytes(const TaskDef *def, const TaskShape *shape);
/* From what engine_model_read fills. */
void envs_model_fill(const EngineTree *tree, const double *number, EngineModel *model);

/* ---- the CPU, environment by environment ---- */
void envs_host_create(const EnvsArrays *all, long robot);
/* Draws the first episode. */
void envs_host_begin(const EnvsArrays *all, long robot);
/* Part k of a policy step, and what follows the last one up to the next episode. */
void envs_host_part(const EnvsArrays *all, const EnvsStep *call, int k, long robot);
/* After part k, where shells stand: the ground under a robot with shells near it. */
void envs_host_shells(const EnvsArrays *all, int k, long robot);
void envs_host_end(const EnvsArrays *all, const EnvsStep *call, long robot);
/* Pose of a new episode, and the observation. */
void envs_host_first(const EnvsArrays *all, const EnvsStep *call, long robot);
/* From arrays.command to the environment. */
void envs_host_set_command(const EnvsArrays *all, long robot);
/* From the environment to arrays.progress, or back. */
void envs_host_move_progress(const EnvsArrays *all, int back);
/* Fills arrays.tally. */
void envs_host_tally(const EnvsArrays *all);
/* From the environment to its block, from the block to the environment. */
void envs_host_save(const EnvsArrays *all, const EnvsFork *fork, long robot);
void envs_host_fork(const EnvsArrays *all, const EnvsFork *fork, long robot);
void envs_host_read(const EnvsArrays *all, const EnvsMotion *motion, long robot);

/* ---- a GPU ---- */

/* The same on a GPU, compiled for robots of one size or for any (batch_device.cu). Functions put
 * their work into the stream and return NULL, or what went wrong. */
typedef struct {
    int fixed;                           /* bool: for robots of one size */
    int (*fits)(const EngineTree *tree); /* bool: for such a robot */
    const char *(*open)(int device);     /* before all that follow; waits */
    EnvsBytes (*bytes)(const TaskDef *def, const TaskShape *shape);
    const char *(*create)(const EnvsArrays *all, MildStream stream);
    const char *(*begin)(const EnvsArrays *all, MildStream stream);
    const char *(*first)(const EnvsArrays *all, const EnvsStep *call, MildStream stream);
    const char *(*part)(const EnvsArrays *all, const EnvsStep *call, int k, MildStream stream);
    const char *(*shells)(const EnvsArrays *all, int k, MildStream stream);
    const char *(*end)(const EnvsArrays *all, const EnvsStep *call, MildStream stream);
    const char *(*move_progress)(const EnvsArrays *all, int back, MildStream stream);
    const char *(*set_command)(const EnvsArrays *all, MildStream stream);
    const char *(*tally)(const EnvsArrays *all, MildStream stream);
    const char *(*save)(const EnvsArrays *all, const EnvsFork *fork, int blocks, MildStream stream);
    const char *(*fork)(const EnvsArrays *all, const EnvsFork *fork, MildStream stream);
    const char *(*read)(const EnvsArrays *all, const EnvsMotion *motion, MildStream stream);
} EnvsKernels;

/* Those of this build, NULL behind them: cmake/Env.cmake. A robot takes the first that fit. */
extern const EnvsKernels *const envs_kernels[];

/* Of the batch engine: for tests. */
const EnvsArrays *envs_batch_arrays(const Envs *envs);

#endif
