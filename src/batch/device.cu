/* The batch on a GPU: a warp a robot. */
#define MILD_REAL_FLOAT

extern "C" {
#include "batch/batch.h"
}

#include <cuda_runtime.h>

#include "batch/contact_kinds.h"
#include "batch/robot.inc"

static_assert(sizeof(ContactMaterial) == sizeof(MaterialNumbers), "the same numbers");
static_assert(sizeof(ContactFoot) == sizeof(MildBatchFoot), "the same numbers");

/* Robots of a block. Two blocks fit a multiprocessor; three would be 1 % faster at 65 536 robots,
 * and 12 % slower at 4096, for they spill registers. */
#ifndef BATCH_WARPS
#define BATCH_WARPS 4
#endif
#ifndef BATCH_BLOCKS
#define BATCH_BLOCKS 2
#endif
enum { WARPS = BATCH_WARPS, THREADS = WARPS * LANES };

extern "C" size_t batch_memory_numbers(const BatchShape *shape);

/* ---- the step ---- */

#define DEVICE_ROBOTS(kind)                                                                        \
    __global__ void __launch_bounds__(THREADS, BATCH_BLOCKS) device_robots_##kind(                            \
        const __grid_constant__ ContactSetup setup, const __grid_constant__ BatchShape shape,      \
        const __grid_constant__ BatchArrays arrays, const __grid_constant__ MildBatchInput input,  \
        const __grid_constant__ MildBatchOutput output, int advance) {                             \
        __shared__ contact_Shared_##kind shared[WARPS];                                            \
        const int warp = (int)(threadIdx.x / LANES);                                               \
        const long robot = (long)blockIdx.x * WARPS + warp;                                        \
        if (robot >= shape.robots) {                                                               \
            return;                                                                                \
        }                                                                                          \
        ContactProblem problem;                                                                    \
        ContactResult result;                                                                      \
        batch_problem(&shape, &arrays, &input, robot, &problem);                                   \
        batch_result(&shape, &output, robot, &result);                                             \
        contact_robot_##kind(&setup, &problem, &shared[warp],                                      \
                             batch_memory(&shape, &arrays, robot), advance, &result);              \
    }
#define DEVICE_KIND(groups, per) DEVICE_ROBOTS(groups##_##per)
#define DEVICE_CONE_KIND(groups, per) DEVICE_ROBOTS(groups##_##per##_cone)
CONTACT_KINDS(DEVICE_KIND)
CONTACT_CONE_KINDS(DEVICE_CONE_KIND)

typedef void (*DeviceRobots)(ContactSetup setup, BatchShape shape, BatchArrays arrays,
                             MildBatchInput input, MildBatchOutput output, int advance);

static DeviceRobots device_robots(const BatchShape *shape, int curves) {
#define DEVICE_CHOICE(g, p)                                                                        \
    if (shape->groups == g && shape->per == p) {                                                   \
        return device_robots_##g##_##p;                                                            \
    }
#define DEVICE_CONE_CHOICE(g, p)                                                                   \
    if (shape->groups == g && shape->per == p && !(curves & ~LAW_CONE)) {                          \
        return device_robots_##g##_##p##_cone;                                                     \
    }
    CONTACT_CONE_KINDS(DEVICE_CONE_CHOICE)
    CONTACT_KINDS(DEVICE_CHOICE)
    return NULL;
}

/* Makes a device the current one, and the caller's again at the end of the scope. */
struct OnDevice {
    int before = 0;
    cudaError_t status;
    explicit OnDevice(int device) {
        cudaGetDevice(&before);
        status = cudaSetDevice(device);
    }
    ~OnDevice() {
        cudaSetDevice(before);
    }
};

static MildStatus checked(cudaError_t status, const char *what, MildError *error) {
    return status == cudaSuccess
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_IO, "batch: %s: %s", what, cudaGetErrorString(status));
}

extern "C" MildStatus device_step(const MildBatch *batch, const MildBatchInput *input,
                                  const MildBatchOutput *output, int advance, void *stream,
                                  MildError *error) {
    const BatchShape *shape = &batch->shape;
    const int blocks = (shape->robots + WARPS - 1) / WARPS;
    ContactSetup setup;
    OnDevice on(batch->device);
    batch_setup(shape, &batch->arrays, &setup);
    device_robots(shape, batch->curves)<<<blocks, THREADS, 0, (cudaStream_t)stream>>>(
        setup, *shape, batch->arrays, *input, *output, advance);
    return checked(cudaGetLastError(), "step", error);
}

/* ---- memory ---- */

extern "C" MildStatus device_wait(int device, MildError *error) {
    OnDevice on(device);
    return checked(cudaDeviceSynchronize(), "step", error);
}

__global__ void device_forget(BatchShape shape, BatchArrays arrays, const uint8_t *which) {
    const long robot = blockIdx.x;
    if (which && !which[robot]) {
        return;
    }
    Real *memory = batch_memory(&shape, &arrays, robot);
    for (int i = (int)threadIdx.x; i < CONTACT_MEMORY * shape.groups * shape.stride;
         i += (int)blockDim.x) {
        memory[i] = 0;
    }
}

extern "C" MildStatus device_reset(const MildBatch *batch, const uint8_t *which, void *stream,
                                   MildError *error) {
    OnDevice on(batch->device);
    device_forget<<<batch->shape.robots, 256, 0, (cudaStream_t)stream>>>(batch->shape,
                                                                         batch->arrays, which);
    return checked(cudaGetLastError(), "reset", error);
}

extern "C" MildStatus device_open(int device, MildError *error) {
    int count = 0;
    const cudaError_t status = cudaGetDeviceCount(&count);
    if (status != cudaSuccess || device >= count) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "batch: device %d is not there (%d found, %s); use MILD_BATCH_HOST for "
                         "the CPU",
                         device, count, cudaGetErrorString(status));
    }
    OnDevice on(device);
    return checked(on.status, "device", error);
}

extern "C" void *device_alloc(int device, size_t bytes, MildError *error) {
    void *memory = NULL;
    size_t free_bytes = 0, all = 0;
    OnDevice on(device);
    cudaMemGetInfo(&free_bytes, &all);
    if (cudaMalloc(&memory, bytes) != cudaSuccess) {
        cudaGetLastError(); /* it is told here */
        mild_fail(error, MILD_ERROR_MEMORY,
                  "batch: out of memory on device %d: %zu MiB are needed, %zu MiB are free; take "
                  "fewer robots",
                  device, bytes >> 20, free_bytes >> 20);
        return NULL;
    }
    if (checked(cudaMemset(memory, 0, bytes), "memory", error) != MILD_OK) {
        cudaFree(memory);
        return NULL;
    }
    return memory;
}

extern "C" void device_free(int device, void *memory) {
    if (memory) {
        OnDevice on(device);
        cudaFree(memory);
    }
}

extern "C" MildStatus device_copy(int device, void *to, const void *from, size_t bytes,
                                  MildError *error) {
    OnDevice on(device);
    return checked(cudaMemcpy(to, from, bytes, cudaMemcpyDefault), "copy", error);
}
