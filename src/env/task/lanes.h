/* What the task's code asks of robot and ground. The files of one policy step (step.c, gait.c,
 * assist.c, observe.c, reward.c, randomize.c) are compiled twice: as they are for the CPU, where
 * robots are stepped by RobotSim, and with TASK_ON_DEVICE by env/batch_step.inc (through
 * env/batch_task.h), where Robot and RobotSim are plain numbers on a device (device_robot.h).
 * TASK_FN marks the functions that one file of them calls in another. */
#ifndef TASK_LANES_H
#define TASK_LANES_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#ifdef __CUDACC__
#include <cuda_fp16.h>
#endif

#include "base/hd.h"

#ifndef TASK_JOINTS /* sizes of a robot's arrays; where the code is compiled for one, its own */
#define TASK_JOINTS ROBOT_JOINTS_MAX
#define TASK_FEET ROBOT_FEET_MAX
#endif

/* TaskReal: a number that an environment keeps, in float on a device. Expressions are computed in
 * double where they read the task's definition or the robot's. */
#ifdef TASK_ON_DEVICE
#define TASK_FN MILD_HD_FN
typedef float TaskReal;
#include "env/task/device_robot.h"
#else
#define TASK_FN
typedef double TaskReal;
#include "robot/robot.h"
typedef MildTerrain TaskTerrain;
#endif
#define TASK_REAL(number) ((TaskReal)(number))

#define TASK_PER_TURN 0.3183098861837907 /* 1/pi */

/* On a GPU to the accuracy of float, for a tenth of the instructions. */
MILD_HD_FN TaskReal task_exp(double x) {
#ifdef __CUDA_ARCH__
    return expf((float)x);
#else
    return (TaskReal)exp(x);
#endif
}

MILD_HD_FN TaskReal task_sin(double x) {
#ifdef __CUDA_ARCH__
    return sinpif((float)(x * TASK_PER_TURN)); /* sinf has a long path for large x */
#else
    return (TaskReal)sin(x);
#endif
}

MILD_HD_FN TaskReal task_cos(double x) {
#ifdef __CUDA_ARCH__
    return cospif((float)(x * TASK_PER_TURN));
#else
    return (TaskReal)cos(x);
#endif
}

MILD_HD_FN TaskReal task_sqrt(double x) {
#ifdef __CUDA_ARCH__
    return sqrtf((float)x);
#else
    return (TaskReal)sqrt(x);
#endif
}

/* Lets a GPU wait for several numbers at once. */
#ifdef __CUDACC__
#define TASK_UNROLL _Pragma("unroll 8")
#else
#define TASK_UNROLL
#endif

/* [m] Height of the base above the undisturbed surface. */
MILD_HD_FN double task_height_above(const RobotSim *sim, const TaskTerrain *terrain) {
#ifdef TASK_ON_DEVICE
    (void)terrain;
    return sim->above;
#else
    const double *qpos = robot_sim_qpos(sim);
    return qpos[2] - mild_terrain_height_at(terrain, qpos[0], qpos[1]);
#endif
}

/* A number of a frame that is kept for the means of the history. On a device it has 16 bits, as in
 * IEEE 754, with a rounding error of at most 2^-11 of the number: the noise of sensors is a hundred
 * times larger. Scaled by 2^-112 a float has the exponent of the short one. */
#ifdef TASK_ON_DEVICE
typedef uint16_t TaskFrame;

MILD_HD_FN TaskFrame frame_pack(float x) {
#ifdef __CUDA_ARCH__
    return __half_as_ushort(__float2half_rn(fminf(fmaxf(x, -65504.0f), 65504.0f)));
#else
    const float size = fminf(fabsf(x), 65504) * 0x1p-112f;
    uint32_t bits;
    memcpy(&bits, &size, sizeof bits);
    return (TaskFrame)(((bits + 0xfff + (bits >> 13 & 1)) >> 13) | (x < 0 ? 0x8000 : 0));
#endif
}

MILD_HD_FN float frame_unpack(TaskFrame frame) {
#ifdef __CUDA_ARCH__
    return __half2float(__ushort_as_half(frame));
#else
    const uint32_t bits = (uint32_t)(frame & 0x7fff) << 13 | (uint32_t)(frame & 0x8000) << 16;
    float size;
    memcpy(&size, &bits, sizeof size);
    return size * 0x1p112f;
#endif
}
#else
typedef float TaskFrame;

static inline TaskFrame frame_pack(float x) {
    return x;
}

static inline float frame_unpack(TaskFrame frame) {
    return frame;
}
#endif

/* Bool: the environment keeps its history for controllers. */
#ifdef TASK_ON_DEVICE
enum { TASK_HAS_HISTORY = 0 };
#else
enum { TASK_HAS_HISTORY = 1 };
#endif

/* On a GPU so many threads, the lanes of an environment, call the functions of a policy step
 * together and take the same way through them. Each has its share of a loop
 *
 *     for (int i = task_lane(); i < count; i += TASK_LANES)
 *
 * and lane 0 adds to what is not in such a loop; what all write is the same number. What one lane
 * writes another reads after task_lanes_sync. */
#ifdef __CUDACC__
enum { TASK_LANES = 8 };
#else
enum { TASK_LANES = 1 };
#endif

MILD_HD_FN int task_lane(void) {
#ifdef __CUDA_ARCH__
    return (int)(threadIdx.x % TASK_LANES);
#else
    return 0;
#endif
}

#ifdef __CUDA_ARCH__
static inline __device__ unsigned task_lane_mask(void) {
    return ((1u << TASK_LANES) - 1) << (threadIdx.x % 32 / TASK_LANES * TASK_LANES);
}
#endif

/* Makes what each lane wrote visible to the others. */
MILD_HD_FN void task_lanes_sync(void) {
#ifdef __CUDA_ARCH__
    __syncwarp(task_lane_mask());
#endif
}

/* Sets numbers of TaskReal, or of float, to 0. */
MILD_HD_FN void task_clear(void *numbers, size_t bytes) {
#ifdef TASK_ON_DEVICE
    float *number = (float *)numbers;
    for (size_t i = (size_t)task_lane(); i < bytes / sizeof *number; i += TASK_LANES) {
        number[i] = 0;
    }
#else
    memset(numbers, 0, bytes);
#endif
}

/* The sum over the lanes. */
MILD_HD_FN TaskReal task_lanes_sum(TaskReal x) {
#ifdef __CUDA_ARCH__
    for (int step = TASK_LANES / 2; step > 0; step /= 2) {
        x += __shfl_xor_sync(task_lane_mask(), x, step);
    }
#endif
    return x;
}

#endif
