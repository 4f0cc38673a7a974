/* A step of a batch with shells on a GPU (bodies_robot.h): a warp a robot, and a team where a
 * shell is near the ground. */
#define MILD_REAL_FLOAT

extern "C" {
#include "ground/batch/bodies_batch.h"
}

#include "device/cuda.h"
#include "ground/batch/bodies_robot.h"

enum {
    WARPS = 4,  /* robots of a block, each with a warp; or those of a team */
    BLOCKS = 3, /* teams of a multiprocessor, at least */
    THREADS = WARPS * LANES
};
static_assert(sizeof(BodiesWork) <= 48 * 1024, "static shared memory");

static __global__ void __launch_bounds__(THREADS) find(const __grid_constant__ BodiesCall call) {
    const long robot = (long)blockIdx.x * WARPS + threadIdx.x / LANES;
    if (robot < call.shape.robots) {
        bodies_find(&call, robot);
    }
}

static __global__ void __launch_bounds__(THREADS) rest(const __grid_constant__ BodiesCall call) {
    const long robot = (long)blockIdx.x * WARPS + threadIdx.x / LANES;
    if (robot < call.shape.robots && !call.bodies.near[robot]) {
        bodies_rest(&call, robot);
    }
}

template <int CURVES>
static __global__ void __launch_bounds__(THREADS, BLOCKS)
    solve(const __grid_constant__ BodiesCall call) {
    __shared__ BodiesWork work;
    if (call.bodies.near[blockIdx.x]) {
        bodies_solve(&call, blockIdx.x, &work, CURVES);
    }
}

static int blocks_of(const BodiesCall *call) {
    return (call->shape.robots + WARPS - 1) / WARPS;
}

extern "C" MildStatus gpu_bodies_begin(const BodiesCall *call, int device, MildStream stream,
                                       MildError *error) {
    OnDevice on(device);
    find<<<blocks_of(call), THREADS, 0, stream>>>(*call);
    return checked(cudaGetLastError(), "step", error);
}

extern "C" MildStatus gpu_bodies_end(const BodiesCall *call, int device, MildStream stream,
                                     MildError *error) {
    OnDevice on(device);
    rest<<<blocks_of(call), THREADS, 0, stream>>>(*call);
    const auto run = call->curves == LAW_CONE  ? solve<LAW_CONE>
                     : call->curves == LAW_ALL ? solve<LAW_ALL>
                                               : solve<LAW_ANY>;
    run<<<call->shape.robots, THREADS, 0, stream>>>(*call);
    return checked(cudaGetLastError(), "step", error);
}
