/* In which order a step of two feet on level ground takes the robots of a batch on a GPU. */
#define MILD_REAL_FLOAT

extern "C" {
#include "ground/batch/batch.h"
}

#include "device/cuda.h"
#include "ground/batch/contact.h"
#include "ground/batch/robot.inc"

enum { THREADS = 1024, WARPS = THREADS / LANES };

/* Fills BatchArrays.order: of each robot its number times 4 and its feet that may touch the
 * ground, bit f for foot f; first those with both, which take longest. Of the others two in a row
 * are a pair (contact_pair.inc).
 *
 * Each of n blocks puts every n-th robot in order. */
static __global__ void __launch_bounds__(THREADS)
    order_robots(const __grid_constant__ ContactSetup setup,
                 const __grid_constant__ BatchShape shape,
                 const __grid_constant__ BatchArrays arrays,
                 const __grid_constant__ MildBatchInput input) {
    __shared__ int count[WARPS];
    const int lane = (int)threadIdx.x % LANES, warp = (int)threadIdx.x / LANES;
    const int robot = (int)(threadIdx.x * gridDim.x + blockIdx.x);
    const int is_robot = robot < shape.robots;
    ContactProblem problem;
    int near = 0;
    if (is_robot) {
        batch_problem(&shape, &arrays, &input, robot, &problem);
        near = contact_near(&setup, &problem, 0) + 2 * contact_near(&setup, &problem, 1);
    }
    const unsigned both = __ballot_sync(~0u, near == 3);
    const int before = __popc(both & ((1u << lane) - 1));
    if (lane == 0) {
        count[warp] = __popc(both);
    }
    __syncthreads();
    int of_others = 0, all = 0;
    for (int w = 0; w < WARPS; w++) {
        of_others += w < warp ? count[w] : 0;
        all += count[w];
    }
    const int ahead = of_others + before; /* with both feet near */
    const int place = near == 3 ? ahead : all + (int)threadIdx.x - ahead;
    if (is_robot) {
        arrays.order[place * (int)gridDim.x + (int)blockIdx.x] = 4 * robot + near;
    }
}

extern "C" MildStatus batch_gpu_order(const MildBatch *batch, const MildBatchInput *input,
                                      MildStream stream, MildError *error) {
    OnDevice on(batch->device);
    ContactSetup setup;
    batch_setup(&batch->shape, &batch->arrays, &setup);
    const int blocks = (batch->shape.robots + THREADS - 1) / THREADS;
    order_robots<<<blocks, THREADS, 0, (cudaStream_t)stream>>>(setup, batch->shape, batch->arrays,
                                                               *input);
    return checked(cudaGetLastError(), "order", error);
}
