/* The kernels on the processor: the threads of a block are coroutines that take turns at every
 * __syncthreads. */
#include <setjmp.h>
#include <ucontext.h>

#include <functional>
#include <vector>

#include "gpu/kernels.h"

int emulated_failure;

static uint3 threadIdx, blockIdx;

namespace {

/* A context makes a coroutine's stack; afterwards jumps switch, which cost no system call. */
struct Fiber {
    ucontext_t context;
    jmp_buf resume;
    std::vector<char> stack;
    bool started, finished;
    uint3 thread;
};
ucontext_t entry;
jmp_buf scheduler;
std::vector<Fiber> fibers;
size_t running;
std::function<void()> body;

void fiber_yield() {
    if (!_setjmp(fibers[running].resume)) {
        _longjmp(scheduler, 1);
    }
}

void fiber_main() {
    for (;;) {
        body();
        fibers[running].finished = true;
        fiber_yield();
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

void run_block(dim3 size) {
    const size_t count = size.x * size.y;
    if (fibers.size() < count) {
        fibers.resize(count); /* once: every block has as many threads */
    }
    for (size_t i = 0; i < count; i++) {
        fibers[i].finished = false;
        fibers[i].thread = uint3{unsigned(i % size.x), unsigned(i / size.x), 0};
    }
    for (size_t left = count; left > 0;) {
        for (size_t i = 0; i < count; i++) {
            if (fibers[i].finished) {
                continue;
            }
            fiber_resume(i);
            left -= fibers[i].finished;
        }
    }
}

void launch(dim3 grid, dim3 block, std::function<void()> kernel) {
    body = kernel;
    for (unsigned y = 0; y < grid.y; y++) {
        for (unsigned x = 0; x < grid.x; x++) {
            blockIdx = uint3{x, y, 0};
            run_block(block);
        }
    }
}

void __syncthreads() {
    fiber_yield();
}

} // namespace

#define __global__
#define __device__
#define __shared__ static
#define LAUNCH(kernel, grid, block, stream, ...)                                                   \
    ((void)(stream), launch(grid, block, [&] { kernel(__VA_ARGS__); }))

#include "gpu/kernels.cu"
