/* Many robots of one kind on a GPU, each stepped by a warp: in the air, on rigid ground or on soft
 * ground. In float; define MILD_REAL_FLOAT before the inclusion. */
#ifndef DEVICE_ROBOTS_H
#define DEVICE_ROBOTS_H

#include <cuda_runtime.h>

#include "ground/batch/batch.h"
#include "robot/engine/model.h"

/* Arrays of all robots lie behind each other in the memory of the device. Joints are in the order
 * of robot.ini. */
typedef struct {
    int count;
    int rigid;                        /* bool: on rigid ground at height 0 */
    const MapView *map;               /* shape of the rigid ground, with arrays on the device; NULL:
                                         level */
    const MildBatch *ground;          /* soft ground under these robots at height 0, on the device,
                                         of cones and lines only; NULL: none */
    const int32_t *material;          /* of the ground's table, as MildBatchInput.material */
    const Real *map_origin;           /* [count][2] [m] on either ground's map; NULL: 0 */
    Real *qpos;                       /* [count][7 + joints] as in RobotState */
    Real *qvel;                       /* [count][6 + joints] */
    const Real *torque;               /* [count][joints] [N m] held over the steps */
    const Real *target;               /* [count][joints] [rad] of a PD that adds to it */
    const Real *kp;                   /* [joints] [N m/rad] of all robots; 0: no PD */
    const Real *kd;                   /* [joints] [N m s/rad] */
    const Real *push;                 /* [count][6] [N, N m] or NULL */
    const EngineVariation *variation; /* [count] */
    Real *acceleration;               /* [count][6 + joints] qacc of the last step, tree's order */
    Real *inverse_inertia;            /* [count][6 feet][6 feet] A of the last step; or NULL */
    int *bad;                         /* [count] set to 1 when a velocity went bad */
} EngineRobots;

/* Puts `steps` steps of all robots into the stream. model: in the memory of the device. */
cudaError_t engine_step_robots(const EngineModel *model, const EngineRobots *robots, int steps,
                               cudaStream_t stream);
/* [B] of shared memory that a robot takes. */
size_t engine_shared_bytes(void);
/* Registers, stack and static shared memory of the kernel with or without soft ground, with or
 * without a map, and robots that a multiprocessor holds. */
cudaError_t engine_kernel_facts(int soft, int map, cudaFuncAttributes *facts, int *robots_at_once);

#endif
