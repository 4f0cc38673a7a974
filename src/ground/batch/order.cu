/* In which order a step of two feet on level ground takes the robots of a batch on a GPU. */
#define MILD_REAL_FLOAT

extern "C" {
#include "ground/batch/batch.h"
}

#include "device/cuda.h"
#include "ground/batch/contact.h"
#include "ground/batch/order.h"
#include "ground/batch/robot.inc"

enum { WARPS = ORDER_ROBOTS / LANES };

/* Fills the list and empties `left`: a block a chunk. Robots with both feet near the ground
 * take longest, and have a kernel of their own. */
static __global__ void __launch_bounds__(ORDER_ROBOTS)
    order_robots(const __grid_constant__ ContactSetup setup,
                 const __grid_constant__ BatchShape shape,
                 const __grid_constant__ BatchArrays arrays,
                 const __grid_constant__ MildBatchInput input) {
    __shared__ int count[WARPS];
    const BatchOrder order = batch_order_of(&shape, &arrays);
    const int lane = (int)threadIdx.x % LANES, warp = (int)threadIdx.x / LANES;
    const int least = shape.robots / order.chunks, more = shape.robots % order.chunks;
    const int chunk = (int)blockIdx.x, thread = (int)threadIdx.x;
    const int size = least + (chunk < more);
    const int robot = chunk * least + (chunk < more ? chunk : more) + thread;
    const int is_robot = thread < size;
    ContactProblem problem;
    int near = 0;
    if (is_robot) {
        batch_problem(&shape, &arrays, &input, robot, &problem);
        near = contact_near(&setup, &problem, 0) + 2 * contact_near(&setup, &problem, 1);
        near = arrays.skip && arrays.skip[robot] ? 3 : near; /* no partner */
    }
    const unsigned both = __ballot_sync(~0u, is_both(near));
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
    const int place = is_both(near) ? ahead : all + thread - ahead;
    /* the odd one is solved with those */
    const int is_odd = place == all && (size - all) % 2;
    if (is_robot) {
        order.list[place * order.chunks + chunk] = 4 * robot + (is_odd ? 3 : near);
    }
    if (chunk == 0 && thread == 0) {
        *order.count = 0;
    }
}

extern "C" MildStatus batch_gpu_order(const MildBatch *batch, const MildBatchInput *input,
                                      MildStream stream, MildError *error) {
    OnDevice on(batch->device);
    ContactSetup setup;
    batch_setup(&batch->shape, &batch->arrays, &setup);
    const int blocks = (batch->shape.robots + ORDER_ROBOTS - 1) / ORDER_ROBOTS;
    order_robots<<<blocks, ORDER_ROBOTS, 0, (cudaStream_t)stream>>>(setup, batch->shape,
                                                                    batch->arrays, *input);
    return checked(cudaGetLastError(), "order", error);
}
