/* What the task's text asks of robot and ground. The files of one policy step (step.c, gait.c,
 * assist.c, observe.c, reward.c, draw.c) are compiled twice: as they are for the CPU, where robots
 * are stepped by RobotSim, and with TASK_ON_DEVICE by crowd.inc, where Robot and RobotSim are plain
 * numbers on a device. TASK_FN marks the functions that one file of them calls in another. */
#ifndef TASK_PLACE_H
#define TASK_PLACE_H

#include <math.h>

#include "base/both.h"

#ifdef TASK_ON_DEVICE
#define TASK_FN static inline MILD_BOTH
#include "task/device_robot.h"
#else
#define TASK_FN
#include "robot/robot.h"
#endif

/* On a GPU to the accuracy of float, for a tenth of the instructions. */
static inline MILD_BOTH double place_exp(double x) {
#ifdef __CUDA_ARCH__
    return (double)expf((float)x);
#else
    return exp(x);
#endif
}

static inline MILD_BOTH double place_sin(double x) {
#ifdef __CUDA_ARCH__
    return (double)sinf((float)x);
#else
    return sin(x);
#endif
}

static inline MILD_BOTH double place_cos(double x) {
#ifdef __CUDA_ARCH__
    return (double)cosf((float)x);
#else
    return cos(x);
#endif
}

static inline MILD_BOTH double place_root(double x) {
#ifdef __CUDA_ARCH__
    return (double)sqrtf((float)x);
#else
    return sqrt(x);
#endif
}

/* Lets a GPU wait for several numbers at once. */
#ifdef __CUDACC__
#define PLACE_UNROLL _Pragma("unroll 8")
#else
#define PLACE_UNROLL
#endif

/* [m] Height of the base above the undisturbed surface. */
static inline MILD_BOTH double place_above(const RobotSim *sim, const MildTerrain *terrain) {
#ifdef TASK_ON_DEVICE
    (void)terrain;
    return sim->above;
#else
    const double *qpos = robot_sim_qpos(sim);
    return qpos[2] - mild_terrain_height_at(terrain, qpos[0], qpos[1]);
#endif
}

/* The material under the base. */
static inline MILD_BOTH const MildMaterial *place_material(const RobotSim *sim,
                                                           const MildTerrain *terrain) {
#ifdef TASK_ON_DEVICE
    return &terrain->materials[sim->label];
#else
    const double *qpos = robot_sim_qpos(sim);
    return &terrain->materials[mild_terrain_material_at(terrain, qpos[0], qpos[1])];
#endif
}

/* Where the history is made: on the CPU the environment keeps it for controllers. */
static inline MILD_BOTH float *place_history(float *own, float *view) {
#ifdef TASK_ON_DEVICE
    (void)own;
    return view;
#else
    (void)view;
    return own;
#endif
}

/* Makes what each lane of an environment wrote visible to the others. */
static inline MILD_BOTH void place_meet(void) {
#ifdef __CUDA_ARCH__
    __syncwarp();
#endif
}

/* [-] Elements of the raster of a sole that one element of the model in use stands for. */
static inline MILD_BOTH double place_cells(const Robot *robot, int model) {
#ifdef TASK_ON_DEVICE
    (void)model;
    return robot->cells;
#else
    return mild_model_is_concentric((MildModel)model) ? mild_sole_elements(robot_rasters(robot)[0])
                                                      : 1;
#endif
}

#endif
