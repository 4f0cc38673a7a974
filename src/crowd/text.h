/* What the text of a crowd gives to crowd.c: on the CPU (host.c), and on a GPU (device.cu, or
 * without_cuda.c). */
#ifndef CROWD_TEXT_H
#define CROWD_TEXT_H

#include "crowd/arrays.h"

#define CROWD_MODEL_NUMBERS ((int)(sizeof(EngineNumbers) / sizeof(Real)))

/* [B] of an environment in CrowdArrays, by the text of the CPU or of a device, which may be
 * compiled for one robot. */
typedef struct {
    size_t stride;
    size_t robot;
} CrowdBytes;
CrowdBytes crowd_host_bytes(const TaskDef *def, const TaskShape *shape);
/* From what engine_model_read fills. */
void crowd_model_fill(const EngineTree *tree, const double *number, EngineModel *model);

/* ---- the CPU, environment by environment ---- */
void crowd_host_create(const CrowdArrays *all, long robot);
/* Draws the first episode. */
void crowd_host_begin(const CrowdArrays *all, long robot);
/* Part k of a policy step, and what follows the last one up to the next episode. */
void crowd_host_part(const CrowdArrays *all, const EnvsStep *call, int k, long robot);
void crowd_host_end(const CrowdArrays *all, const EnvsStep *call, long robot);
/* Pose of a new episode, and the observation. */
void crowd_host_first(const CrowdArrays *all, const EnvsStep *call, long robot);
/* From arrays.command to the environment. */
void crowd_host_tell(const CrowdArrays *all, long robot);
/* From the environment to arrays.kept, or back. */
void crowd_host_keep(const CrowdArrays *all, int back);
/* Fills arrays.tally. */
void crowd_host_tally(const CrowdArrays *all);

/* ---- a GPU ---- */

/* The same on a GPU, compiled for robots of one size or for any (device.cu). Functions put their
 * work into the stream and return NULL, or what went wrong. */
typedef struct {
    int fixed;                           /* bool: for robots of one size */
    int (*fits)(const EngineTree *tree); /* bool: for such a robot */
    const char *(*open)(void);           /* before all that follow; waits */
    CrowdBytes (*bytes)(const TaskDef *def, const TaskShape *shape);
    const char *(*create)(const CrowdArrays *all, void *stream);
    const char *(*begin)(const CrowdArrays *all, void *stream);
    const char *(*first)(const CrowdArrays *all, const EnvsStep *call, void *stream);
    const char *(*part)(const CrowdArrays *all, const EnvsStep *call, int k, void *stream);
    const char *(*end)(const CrowdArrays *all, const EnvsStep *call, void *stream);
    const char *(*keep)(const CrowdArrays *all, int back, void *stream);
    const char *(*tell)(const CrowdArrays *all, void *stream);
    const char *(*tally)(const CrowdArrays *all, void *stream);
} CrowdKernels;

/* Those of this build, NULL behind them: cmake/Crowd.cmake, or without_cuda.c. A robot takes the
 * first that fit. */
extern const CrowdKernels *const crowd_kernels[];

#endif
