/* What the kernels share: shapes of blocks, and sums in a fixed order. CUDA C++. */
#ifndef MILD_GPU_LAUNCH_H
#define MILD_GPU_LAUNCH_H

#include <cuda_runtime_api.h>
#include <stdint.h>

#define THREADS 256

#ifndef LAUNCH /* the tests run the kernels on the CPU */
#define LAUNCH(kernel, grid, block, stream, ...) kernel<<<grid, block, 0, stream>>>(__VA_ARGS__)
#endif

static const dim3 line = {THREADS, 1, 1}; /* of threads: the block of nearly every kernel */
static const dim3 one_block = {1, 1, 1};

static inline dim3 blocks_of(int64_t items) {
    const dim3 grid = {items > 0 ? (unsigned)((items + THREADS - 1) / THREADS) : 1u, 1, 1};
    return grid;
}

static __device__ inline int64_t item() {
    return (int64_t)blockIdx.x * THREADS + threadIdx.x;
}

/* The block's sum of x, to every thread; every thread of the block calls. Sixteen threads add
 * sixteen numbers each, then everyone adds theirs. */
static __device__ inline double block_sum(double x) {
    enum { SIDE = 16 };
    static_assert(SIDE * SIDE == THREADS, "a square");
    __shared__ double part[THREADS], row[SIDE];
    double sum = 0.0;
    part[threadIdx.x] = x;
    __syncthreads();
    if (threadIdx.x < SIDE) {
        for (int k = 0; k < SIDE; k++) {
            sum += part[k * SIDE + threadIdx.x];
        }
        row[threadIdx.x] = sum;
    }
    __syncthreads();
    sum = 0.0;
    for (int k = 0; k < SIDE; k++) {
        sum += row[k];
    }
    __syncthreads();
    return sum;
}

#endif
