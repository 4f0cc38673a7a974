/* Numbers and lanes of the task's functions, which are the same code on the CPU and on a GPU:
 * step.h, gait.h, assist.h, observe.h, reward.h, randomize.h. They are compiled twice, as the
 * ground's law is: for robots that MuJoCo steps (task.h) with Real = double, and for those of the
 * batch engine (env/batch_step.h) with Real = float. */
#ifndef TASK_LANES_H
#define TASK_LANES_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#ifdef __CUDACC__
#include <cuda_fp16.h>
#endif

#include "base/hd.h"
#include "robot/limits.h"

#ifndef TASK_JOINTS /* sizes of a robot's arrays; where the code is compiled for one, its own */
#define TASK_JOINTS ROBOT_JOINTS_MAX
#define TASK_FEET ROBOT_FEET_MAX
#endif

/* ---- numbers ---- */

/* What an environment keeps is a Real. Expressions are computed in double where they read the
 * task's definition or the robot's. */

#define TASK_PI 3.141592653589793
#define TASK_TWO_PI 6.283185307179586
#define TASK_PER_TURN 0.3183098861837907 /* 1/pi */

/* On a GPU to the accuracy of float, for a tenth of the instructions. */
MILD_HD_FN Real task_exp(double x) {
#ifdef __CUDA_ARCH__
    return expf((float)x);
#else
    return (Real)exp(x);
#endif
}

MILD_HD_FN Real task_sin(double x) {
#ifdef __CUDA_ARCH__
    return sinpif((float)(x * TASK_PER_TURN)); /* sinf has a long path for large x */
#else
    return (Real)sin(x);
#endif
}

MILD_HD_FN Real task_cos(double x) {
#ifdef __CUDA_ARCH__
    return cospif((float)(x * TASK_PER_TURN));
#else
    return (Real)cos(x);
#endif
}

MILD_HD_FN Real task_sqrt(double x) {
#ifdef __CUDA_ARCH__
    return sqrtf((float)x);
#else
    return (Real)sqrt(x);
#endif
}

/* Lets a GPU wait for several numbers at once. */
#ifdef __CUDACC__
#define TASK_UNROLL _Pragma("unroll 8")
#else
#define TASK_UNROLL
#endif

MILD_HD_FN Real task_square(Real x) {
    return x * x;
}

MILD_HD_FN Real task_clamp(Real x, Real low, Real high) {
    return x < low ? low : x > high ? high : x;
}

/* A number of a frame that is kept for the means of the history. Where Real is float it has 16
 * bits, as in IEEE 754, with a rounding error of at most 2^-11 of the number: the noise of sensors
 * is a hundred times larger. Scaled by 2^-112 a float has the exponent of the short one. */
#ifdef MILD_REAL_FLOAT
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

MILD_HD_FN TaskFrame frame_pack(float x) {
    return x;
}

MILD_HD_FN float frame_unpack(TaskFrame frame) {
    return frame;
}
#endif

/* ---- lanes ---- */

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

/* Sets numbers to 0. */
MILD_HD_FN void task_clear(void *numbers, size_t bytes) {
#ifdef __CUDA_ARCH__
    float *number = (float *)numbers;
    for (size_t i = (size_t)task_lane(); i < bytes / sizeof *number; i += TASK_LANES) {
        number[i] = 0;
    }
#else
    memset(numbers, 0, bytes);
#endif
}

/* The sum over the lanes. */
MILD_HD_FN Real task_lanes_sum(Real x) {
#ifdef __CUDA_ARCH__
    for (int step = TASK_LANES / 2; step > 0; step /= 2) {
        x += __shfl_xor_sync(task_lane_mask(), x, step);
    }
#endif
    return x;
}

#endif
