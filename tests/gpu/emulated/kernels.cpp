/* The kernels on the CPU: the threads of a block run one after the other. One that waits at
 * __syncthreads keeps its coroutine, and the next thread runs in another. */
#include <setjmp.h>
#include <ucontext.h>

#include <functional>
#include <vector>

#include "learn/cuda/kernels.h"
#include "learn/cuda/update.h"

int emulated_failure;
size_t emulated_memory = (size_t)1 << 34;

static uint3 threadIdx, blockIdx, gridDim;

namespace {

/* A context makes a coroutine's stack; afterwards jumps switch, which cost no system call. */
struct Fiber {
    ucontext_t context;
    jmp_buf resume;
    std::vector<char> stack;
    bool started, waits; /* waits: at __syncthreads */
    uint3 thread;        /* its thread then */
};
ucontext_t entry;
jmp_buf scheduler;
std::vector<Fiber> fibers;
size_t running;
std::function<void()> body;
dim3 size;
unsigned next_thread, threads;

void fiber_yield(bool waits) {
    fibers[running].waits = waits;
    if (!_setjmp(fibers[running].resume)) {
        _longjmp(scheduler, 1);
    }
}

/* Runs threads of the block until one waits or none is left. */
void fiber_main() {
    for (;;) {
        while (next_thread < threads) {
            const unsigned i = next_thread++;
            threadIdx = uint3{i % size.x, i / size.x, 0};
            fibers[running].thread = threadIdx;
            body();
        }
        fiber_yield(false);
    }
}

void fiber_start(Fiber &fiber) {
    fiber.started = true;
    fiber.stack.resize(65536);
    getcontext(&fiber.context);
    fiber.context.uc_stack.ss_sp = fiber.stack.data();
    fiber.context.uc_stack.ss_size = fiber.stack.size();
    makecontext(&fiber.context, fiber_main, 0);
    swapcontext(&entry, &fiber.context);
}

void fiber_resume(size_t i) {
    Fiber &fiber = fibers[i];
    running = i;
    threadIdx = fiber.thread;
    if (_setjmp(scheduler)) {
        return;
    }
    if (fiber.started) {
        _longjmp(fiber.resume, 1);
    }
    fiber_start(fiber);
}

/* Every thread comes to the first barrier or to its end, then those that wait to the next. */
void run_block() {
    size_t used = 0;
    for (next_thread = 0; next_thread < threads; used++) {
        fiber_resume(used);
    }
    for (bool left = true; left;) {
        left = false;
        for (size_t i = 0; i < used; i++) {
            if (fibers[i].waits) {
                fiber_resume(i);
                left |= fibers[i].waits;
            }
        }
    }
}

void launch(dim3 grid, dim3 block, std::function<void()> kernel) {
    body = kernel;
    size = block;
    gridDim = grid;
    threads = block.x * block.y;
    if (fibers.size() < threads) {
        fibers.resize(threads); /* once: no block has more threads than the first */
    }
    for (unsigned y = 0; y < grid.y; y++) {
        for (unsigned x = 0; x < grid.x; x++) {
            blockIdx = uint3{x, y, 0};
            run_block();
        }
    }
}

void __syncthreads() {
    fiber_yield(true);
}

} // namespace

#define __global__
#define __device__
#define __shared__ static
#define __launch_bounds__(...)
#define LAUNCH(kernel, grid, block, stream, ...)                                                   \
    ((void)(stream), launch(grid, block, [&] { kernel(__VA_ARGS__); }))

#include "learn/cuda/kernels.cu"
#include "learn/cuda/update.cu"
