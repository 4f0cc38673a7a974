/* Robots of a batch on a GPU forget. */
#define MILD_REAL_FLOAT

extern "C" {
#include "ground/batch/batch.h"
}

#include "device/cuda.h"
#include "ground/batch/contact.h"
#include "ground/batch/robot.inc"

static __global__ void forget(BatchShape shape, BatchArrays arrays, BatchBodies bodies,
                              const uint8_t *which) {
    const int robot = (int)blockIdx.x;
    if (which && !which[robot]) {
        return;
    }
    const ContactMemory memory = batch_memory(&shape, &arrays, robot);
    const int elements = shape.groups * shape.stride;
    const int numbers = contact_memory_numbers(elements, shape.map);
    for (int i = (int)threadIdx.x; i < numbers; i += (int)blockDim.x) {
        memory.numbers[i] = 0;
    }
    for (int i = (int)threadIdx.x; memory.worn && i < elements; i += (int)blockDim.x) {
        memory.worn[i] = 0;
    }
    for (size_t i = threadIdx.x; i < bodies.numbers; i += blockDim.x) {
        bodies.memory[(size_t)robot * bodies.numbers + i] = 0;
    }
}

extern "C" MildStatus batch_gpu_reset(const MildBatch *batch, const uint8_t *which,
                                      MildStream stream, MildError *error) {
    OnDevice on(batch->device);
    forget<<<batch->shape.robots, 256, 0, stream>>>(batch->shape, batch->arrays, batch->bodies,
                                                    which);
    return checked(cudaGetLastError(), "reset", error);
}
