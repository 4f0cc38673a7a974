/* The batch engine on a GPU, compiled for robots of one size (ENGINE_JOINTS ... of model.h), or
 * without these definitions for any, by cmake/Env.cmake. Before the inclusion: ENVS_KERNELS, the
 * name of what it gives. */
#define MILD_REAL_FLOAT
#include <cuda_runtime.h>

#include "device/cuda.h"
#include "env/batch_fork.h"
#include "env/kernels.h"

#ifndef ENVS_BLOCKS
#define ENVS_BLOCKS (ENGINE_FIXED ? 3 : 1) /* blocks of a multiprocessor, at least */
#endif
#ifndef ENVS_WARPS
/* Robots of a block, eight, or as many as leave room for ENVS_BLOCKS blocks in the 228 KiB of
 * shared memory of an H100, of which it takes 1 KiB a block: 5 with 29 joints. Those of a block
 * begin together and read the same instructions. */
#define ENVS_ROOM ((228 / ENVS_BLOCKS - 1) * 1024 / (int)sizeof(EnvWork))
#define ENVS_WARPS (!ENGINE_FIXED ? 1 : ENVS_ROOM < 8 ? ENVS_ROOM : 8)
#endif
enum {
    WARP_THREADS = LANES * ENVS_WARPS,
    TASK_THREADS = 128,
    TASK_ROBOTS = TASK_THREADS / TILE, /* of a block */
    TASK_BLOCKS = 8,                   /* blocks of a multiprocessor, at least */
    /* Of a robot with shells near the ground; and such robots of a multiprocessor, at least. Shared
     * memory has room for three with four feet and their calves. */
    SHELLS_WARPS = ENGINE_FEET > 2 ? 4 : 3,
    SHELLS_BLOCKS = ENGINE_FEET > 2 ? 3 : 4,
    SHELLS_ROBOTS = 512, /* stepped at once, at most: an H100 has room for 528 */
    TALLY_THREADS = 256,
    ORDER_THREADS = 1024,
    FORK_THREADS = 128
};

static const size_t work_bytes = ENVS_WARPS * sizeof(EnvWork);
static const size_t shells_bytes = sizeof(EnvShellsWork) > sizeof(EnvFloorWork)
                                       ? sizeof(EnvShellsWork)
                                       : sizeof(EnvFloorWork);

static __device__ long warp_robot(void) {
    return (long)blockIdx.x * ENVS_WARPS + threadIdx.x / LANES;
}

/* TILE threads have a robot. */
static __device__ long lanes_robot(void) {
    return (long)blockIdx.x * TASK_ROBOTS + threadIdx.x / TILE;
}

static int warp_blocks(int envs) {
    return (envs + ENVS_WARPS - 1) / ENVS_WARPS;
}

static int lanes_blocks(int envs) {
    return (envs + TASK_ROBOTS - 1) / TASK_ROBOTS;
}

static __device__ int *waiting_of(const EnvsArrays *all, int k) {
    return all->shells.waiting + 2 * (k % 2);
}

/* Lists a robot after part k if its shells may touch the ground. The order is that of arrival: each
 * robot is stepped by itself. */
static __device__ void list_shells(const EnvsArrays *all, long robot, int k) {
    if (env_shells_wait(all, robot) && env_shells_follow(all, robot, k) &&
        threadIdx.x % LANES == 0) {
        all->shells.list[atomicAdd(&waiting_of(all, k)[0], 1)] = (int32_t)robot;
    }
}

template <int SAMPLED, int SHELLS>
static __global__ void __launch_bounds__(WARP_THREADS, ENVS_BLOCKS)
    part(const __grid_constant__ EnvsArrays all, const __grid_constant__ EnvsStep call, int k) {
    extern __shared__ __align__(16) Real shared[];
    const long place = warp_robot();
    if (SHELLS && blockIdx.x == 0 && threadIdx.x < 2) {
        waiting_of(&all, k + 1)[threadIdx.x] = 0;
    }
    if (place < all.envs) {
        const long robot = all.order[place];
        env_part(&all, &call, robot, k, SAMPLED, SHELLS, (EnvWork *)shared + threadIdx.x / LANES);
        if (SHELLS && k < env_physics_steps(all.task)) {
            list_shells(&all, robot, k);
        }
    }
}

/* Steps the robots in the list of part k, a block one after the other. */
template <int CURVES>
static __global__ void __launch_bounds__(LANES *SHELLS_WARPS, SHELLS_BLOCKS)
    shells(const __grid_constant__ EnvsArrays all, int k) {
    extern __shared__ __align__(16) Real shared[];
    __shared__ int place;
    kernel_let_go(); /* the ground under all other robots may begin */
    int *const waiting = waiting_of(&all, k);
    const int count = waiting[0];
    for (;;) {
        if (threadIdx.x == 0) {
            place = atomicAdd(&waiting[1], 1);
        }
        __syncthreads();
        const int own = place;
        if (own >= count) {
            return;
        }
        const long robot = all.shells.list[own];
        if (!all.rigid[robot]) {
            env_shells_step(&all, robot, (EnvShellsWork *)shared, CURVES);
        } else if (TEAM_WARP == 0) {
            env_floor_step(&all, robot, (EnvFloorWork *)shared);
        }
        __syncthreads();
    }
}

static __global__ void __launch_bounds__(TASK_THREADS, TASK_BLOCKS)
    end(const __grid_constant__ EnvsArrays all, const __grid_constant__ EnvsStep call) {
    const long robot = lanes_robot();
    if (robot < all.envs) {
        env_end(&all, &call, robot);
    }
}

static __global__ void __launch_bounds__(TASK_THREADS)
    create(const __grid_constant__ EnvsArrays all) {
    const long robot = lanes_robot();
    if (robot < all.envs) {
        env_create(&all, robot);
    }
}

static __global__ void __launch_bounds__(TASK_THREADS)
    begin(const __grid_constant__ EnvsArrays all) {
    const long robot = lanes_robot();
    if (robot < all.envs) {
        env_begin(&all, robot);
    }
}

static __global__ void __launch_bounds__(WARP_THREADS)
    pose(const __grid_constant__ EnvsArrays all) {
    extern __shared__ __align__(16) Real shared[];
    const long robot = warp_robot();
    if (robot < all.envs) {
        env_pose(&all, robot, (EnvWork *)shared + threadIdx.x / LANES);
    }
}

static __global__ void __launch_bounds__(TASK_THREADS, TASK_BLOCKS)
    observe(const __grid_constant__ EnvsArrays all, const __grid_constant__ EnvsStep call) {
    const long robot = lanes_robot();
    if (robot < all.envs) {
        env_observe(&all, &call, robot);
    }
}

static __global__ void __launch_bounds__(TASK_THREADS)
    set_command(const __grid_constant__ EnvsArrays all) {
    const long robot = lanes_robot();
    if (robot < all.envs) {
        env_set_command(&all, robot);
    }
}

/* The order in which the robots are stepped, by one block: a warp on rigid ground takes other paths
 * than one on soft ground, so that a block has but one kind. */
static __global__ void __launch_bounds__(ORDER_THREADS)
    arrange(const __grid_constant__ EnvsArrays all) {
    __shared__ int rigid[ORDER_THREADS + 1];
    const int t = (int)threadIdx.x;
    const int begin = (int)((long)all.envs * t / ORDER_THREADS);
    const int end = (int)((long)all.envs * (t + 1) / ORDER_THREADS);
    int count = 0;
    for (int i = begin; i < end; i++) {
        count += all.rigid[i];
    }
    rigid[t + 1] = count;
    rigid[0] = 0;
    for (int step = 1; step < ORDER_THREADS; step *= 2) { /* sums up to each thread */
        __syncthreads();
        const int before = t + 1 > step ? rigid[t + 1 - step] : 0;
        __syncthreads();
        rigid[t + 1] += before;
    }
    __syncthreads();
    int first = rigid[t];
    int rest = rigid[ORDER_THREADS] + begin - first;
    for (int i = begin; i < end; i++) {
        all.order[all.rigid[i] ? first++ : rest++] = i;
    }
}

static __global__ void __launch_bounds__(TASK_THREADS)
    move_progress(const __grid_constant__ EnvsArrays all, int back) {
    const long robot = lanes_robot();
    if (robot < all.envs) {
        env_move_progress(&all, robot, back);
    }
}

/* Block n sums number n of all tallies, in a fixed order. */
static __global__ void __launch_bounds__(TALLY_THREADS)
    tally(const __grid_constant__ EnvsArrays all) {
    __shared__ double part[TALLY_THREADS];
    double sum = 0;
    for (long robot = threadIdx.x; robot < all.envs; robot += TALLY_THREADS) {
        sum += env_tally(&all, robot, (int)blockIdx.x);
    }
    part[threadIdx.x] = sum;
    for (int half = TALLY_THREADS / 2; half > 0; half /= 2) {
        __syncthreads();
        if ((int)threadIdx.x < half) {
            part[threadIdx.x] += part[threadIdx.x + half];
        }
    }
    if (threadIdx.x == 0) {
        all.tally[blockIdx.x] = part[0];
    }
}

static __global__ void __launch_bounds__(TILE)
    weigh(const __grid_constant__ EnvsArrays all, const __grid_constant__ EnvsFork fork) {
    env_weigh(&all, &fork, fork.first + blockIdx.x);
}

/* A block for each row of an environment. */
static __global__ void __launch_bounds__(FORK_THREADS) save(const __grid_constant__ EnvsFork fork) {
    env_move_row(&fork, (int)blockIdx.y, fork.first + blockIdx.x, 1, (int)threadIdx.x,
                 FORK_THREADS);
}

/* A block for each environment. */
static __global__ void __launch_bounds__(FORK_THREADS)
    fork_all(const __grid_constant__ EnvsArrays all, const __grid_constant__ EnvsFork fork) {
    const long robot = blockIdx.x;
    const EnvKept kept = env_keep(&all, robot);
    __syncthreads();
    env_move_rows(&fork, robot, 0, (int)threadIdx.x, FORK_THREADS);
    __syncthreads();
    if (threadIdx.x < TILE) {
        env_take_back(&all, &fork, robot, &kept);
    }
}

static __global__ void __launch_bounds__(TASK_THREADS)
    read(const __grid_constant__ EnvsArrays all, const __grid_constant__ EnvsMotion motion) {
    const long robot = lanes_robot();
    if (robot < all.envs) {
        env_read_motion(&all, &motion, robot);
    }
}

/* NULL, or the last error. */
static const char *launched(void) {
    const cudaError_t status = cudaGetLastError();
    return status == cudaSuccess ? NULL : cudaGetErrorString(status);
}

static EnvsBytes kernels_bytes(const TaskDef *def, const TaskShape *shape) {
    const EnvsBytes bytes = {env_stride(def, shape), sizeof(EnvRobot), sizeof(EnvShells)};
    return bytes;
}

static int kernels_fits(const EngineTree *tree) {
    return !ENGINE_FIXED || (tree->joints == ENGINE_JOINTS && tree->feet == ENGINE_FEET &&
                             tree->corners == ENGINE_CORNERS && tree->entries == ENGINE_ENTRIES &&
                             tree->chain == ENGINE_CHAIN && tree->bodies <= ENGINE_BODIES);
}

static const char *kernels_open(int device) {
    OnDevice on(device);
    const cudaFuncAttribute most = cudaFuncAttributeMaxDynamicSharedMemorySize;
    cudaFuncSetAttribute(part<0, 0>, most, (int)work_bytes);
    cudaFuncSetAttribute(part<1, 0>, most, (int)work_bytes);
    cudaFuncSetAttribute(part<0, 1>, most, (int)work_bytes);
    cudaFuncSetAttribute(part<1, 1>, most, (int)work_bytes);
    cudaFuncSetAttribute(pose, most, (int)work_bytes);
    cudaFuncSetAttribute(shells<LAW_CONE>, most, (int)shells_bytes);
    cudaFuncSetAttribute(shells<LAW_ALL>, most, (int)shells_bytes);
    cudaFuncSetAttribute(shells<LAW_ANY>, most, (int)shells_bytes);
    return launched();
}

/* Launches a kernel whose blocks start before waiting blocks of the ground's kernel. The ground
 * takes longest, so other slices fill its places meanwhile. */
template <typename... Types, typename... Arguments>
static const char *launch(void (*kernel)(Types...), int blocks, int threads, size_t shared,
                          MildStream stream, const Arguments &...arguments) {
    cudaLaunchAttribute first = {};
    first.id = cudaLaunchAttributePriority;
    first.val.priority = -1; /* of the ground: 0, in streams of default priority */
    cudaLaunchConfig_t config = {};
    config.gridDim = dim3((unsigned)blocks);
    config.blockDim = dim3((unsigned)threads);
    config.dynamicSmemBytes = shared;
    config.stream = (cudaStream_t)stream;
    config.attrs = &first;
    config.numAttrs = 1;
    cudaLaunchKernelEx(&config, kernel, Types(arguments)...);
    return launched();
}

static const char *kernels_create(const EnvsArrays *all, MildStream stream) {
    OnDevice on(all->device);
    create<<<lanes_blocks(all->envs), TASK_THREADS, 0, stream>>>(*all);
    return launched();
}

static const char *kernels_begin(const EnvsArrays *all, MildStream stream) {
    OnDevice on(all->device);
    begin<<<lanes_blocks(all->envs), TASK_THREADS, 0, stream>>>(*all);
    return launched();
}

static const char *kernels_part(const EnvsArrays *all, const EnvsStep *call, int k,
                                MildStream stream) {
    OnDevice on(all->device);
    const auto run = all->shells.setup ? (all->sample ? part<1, 1> : part<0, 1>)
                                       : (all->sample ? part<1, 0> : part<0, 0>);
    return launch(run, warp_blocks(all->envs), WARP_THREADS, work_bytes, stream, *all, *call, k);
}

static const char *kernels_shells(const EnvsArrays *all, int k, MildStream stream) {
    OnDevice on(all->device);
    const int steps = all->envs < SHELLS_ROBOTS ? all->envs : SHELLS_ROBOTS;
    const auto run = all->shells.curves == LAW_CONE  ? shells<LAW_CONE>
                     : all->shells.curves == LAW_ALL ? shells<LAW_ALL>
                                                     : shells<LAW_ANY>;
    return launch(run, steps, LANES * SHELLS_WARPS, shells_bytes, stream, *all, k);
}

static const char *kernels_end(const EnvsArrays *all, const EnvsStep *call, MildStream stream) {
    OnDevice on(all->device);
    return launch(end, lanes_blocks(all->envs), TASK_THREADS, 0, stream, *all, *call);
}

static const char *kernels_first(const EnvsArrays *all, const EnvsStep *call, MildStream stream) {
    OnDevice on(all->device);
    const char *why = launch(pose, warp_blocks(all->envs), WARP_THREADS, work_bytes, stream, *all);
    if (!why) {
        why = launch(observe, lanes_blocks(all->envs), TASK_THREADS, 0, stream, *all, *call);
    }
    return why ? why : launch(arrange, 1, ORDER_THREADS, 0, stream, *all);
}

static const char *kernels_move_progress(const EnvsArrays *all, int back, MildStream stream) {
    OnDevice on(all->device);
    move_progress<<<lanes_blocks(all->envs), TASK_THREADS, 0, stream>>>(*all, back);
    return launched();
}

static const char *kernels_set_command(const EnvsArrays *all, MildStream stream) {
    OnDevice on(all->device);
    set_command<<<lanes_blocks(all->envs), TASK_THREADS, 0, stream>>>(*all);
    return launched();
}

static const char *kernels_tally(const EnvsArrays *all, MildStream stream) {
    OnDevice on(all->device);
    tally<<<TALLY_NUMBERS, TALLY_THREADS, 0, stream>>>(*all);
    return launched();
}

static const char *kernels_save(const EnvsArrays *all, const EnvsFork *fork, int blocks,
                                MildStream stream) {
    OnDevice on(all->device);
    const dim3 grid((unsigned)blocks, (unsigned)fork->count);
    weigh<<<blocks, TILE, 0, stream>>>(*all, *fork);
    save<<<grid, FORK_THREADS, 0, stream>>>(*fork);
    return launched();
}

static const char *kernels_fork(const EnvsArrays *all, const EnvsFork *fork, MildStream stream) {
    OnDevice on(all->device);
    fork_all<<<all->envs, FORK_THREADS, 0, stream>>>(*all, *fork);
    return launched();
}

static const char *kernels_read(const EnvsArrays *all, const EnvsMotion *motion,
                                MildStream stream) {
    OnDevice on(all->device);
    read<<<lanes_blocks(all->envs), TASK_THREADS, 0, stream>>>(*all, *motion);
    return launched();
}

extern "C" {
extern const EnvsKernels ENVS_KERNELS;
const EnvsKernels ENVS_KERNELS = {
    ENGINE_FIXED,   kernels_fits,  kernels_open,          kernels_bytes,
    kernels_create, kernels_begin, kernels_first,         kernels_part,
    kernels_shells, kernels_end,   kernels_move_progress, kernels_set_command,
    kernels_tally,  kernels_save,  kernels_fork,          kernels_read};
}
