/* The contact step of a batch on a GPU: a warp a robot, or two. cmake/Batch.cmake makes a unit of
 * each size. Before the inclusion: KERNEL, the name of what it gives; KERNEL_GROUPS, KERNEL_PER,
 * KERNEL_POINTS and KERNEL_CURVES, what they are for (contact.inc); KERNEL_ROBOTS of
 * a multiprocessor; KERNEL_PAIRS, 1 where a warp may have two robots of which one foot is in the
 * air. */
#define MILD_REAL_FLOAT
#define REAL_FORGETS /* what is no number shows in the forces */

extern "C" {
#include "ground/batch/batch.h"
}

#include "device/cuda.h"
#include "ground/batch/contact.h"
#include "ground/batch/contact_shapes.h"
#include "ground/batch/order.h"

enum {
    CONTACT_FEET = KERNEL_GROUPS,
    CONTACT_PER = KERNEL_PER,
    CONTACT_CURVES = KERNEL_CURVES,
    CONTACT_POINTS = KERNEL_POINTS
};
namespace level {
enum { CONTACT_MAP = 0, CONTACT_PAIRS = 0 };
#include "ground/batch/contact.inc"
} // namespace level
namespace map {
enum { CONTACT_MAP = 1, CONTACT_PAIRS = 0 };
#include "ground/batch/contact.inc"
} // namespace map
#if KERNEL_PAIRS
namespace pair {
enum { CONTACT_MAP = 0, CONTACT_PAIRS = 1 };
#include "ground/batch/contact.inc"
} // namespace pair
#endif
#include "ground/batch/robot.inc"

static_assert(sizeof(ContactMaterial) == sizeof(MaterialNumbers), "the same numbers");
static_assert(sizeof(ContactFoot) == sizeof(MildBatchFoot), "the same numbers");

/* A block has one robot: one that takes long keeps no other's place. With a map and a share an
 * element has more numbers than there is shared memory for on sixteen robots. */
#define MAP_ROBOTS (map::CONTACT_HEAP && KERNEL_ROBOTS > 12 ? 12 : KERNEL_ROBOTS)
#define CONTACT_ARGUMENTS                                                                          \
    const __grid_constant__ ContactSetup setup, const __grid_constant__ BatchShape shape,          \
        const __grid_constant__ BatchArrays arrays, const __grid_constant__ MildBatchInput input,  \
        const __grid_constant__ MildBatchOutput output, int advance
#define LEFT_BLOCKS 2048 /* of contact_rest that do what contact_pairs has left */
/* Bool: robot i is among those of a step. */
#define IS_STEPPED(i) (!(arrays.skip && arrays.skip[i]))
/* Steps robot i; at, done: foot and done of the version `pair`, where i differs between lanes. */
#define CONTACT_ROBOT(version, shared, i, at, done)                                                \
    {                                                                                              \
        ContactProblem problem;                                                                    \
        ContactResult result;                                                                      \
        const ContactMemory memory = batch_memory(&shape, &arrays, i);                             \
        batch_problem(&shape, &arrays, &input, i, &problem);                                       \
        batch_result(&shape, &output, i, &result);                                                 \
        problem.foot = at;                                                                         \
        version::contact_robot(&setup, &problem, shared, &memory, advance, &result, done);         \
        __syncwarp(); /* for `shared` */                                                           \
    }

static __global__ void __launch_bounds__(LANES, KERNEL_ROBOTS) contact_level(CONTACT_ARGUMENTS) {
    __shared__ level::ContactShared shared;
    if (IS_STEPPED(blockIdx.x)) {
        CONTACT_ROBOT(level, &shared, (int)blockIdx.x, 0, NULL)
    }
    if (arrays.beside && blockIdx.x == 0) {
        kernel_wait();
    }
}

#if KERNEL_PAIRS
/* Two robots with one foot near the ground or none. Where they are no pair they are left for
 * contact_rest: a kernel with the code of both waits longer for instructions. */
static __global__ void __launch_bounds__(LANES, KERNEL_ROBOTS) contact_pairs(CONTACT_ARGUMENTS) {
    __shared__ pair::ContactShared shared;
    const BatchOrder order = batch_order_of(&shape, &arrays);
    const int chunk = (int)blockIdx.x, chunks = (int)gridDim.x;
    int last = 2 * (int)gridDim.y - 1; /* a chunk may have one or two places less */
    last -= last * chunks + chunk >= shape.robots;
    last -= last * chunks + chunk >= shape.robots;
    const int place = last - 2 * (int)blockIdx.y - (int)threadIdx.x / (LANES / 2);
    if (!arrays.beside) {
        kernel_wait(); /* for order.cu */
    }
    kernel_let_go();
    const int turn = place >= 0 ? __ldcg(&order.list[place * chunks + chunk]) : 3;
    const int waits = !is_both(turn) && IS_STEPPED(turn / 4);
    int done = 0;
    if (__all_sync(~0u, waits)) {
        CONTACT_ROBOT(pair, &shared, turn / 4, turn % 4 / 2, &done)
    }
    if (waits && !done && threadIdx.x % (LANES / 2) == 0) {
        order.left[atomicAdd(order.count, 1)] = turn;
    }
    if (arrays.beside && blockIdx.x + blockIdx.y == 0) {
        kernel_wait();
    }
}

/* The robots with both feet near it, beside contact_pairs; then, by the last blocks, those left. */
static __global__ void __launch_bounds__(LANES, KERNEL_ROBOTS) contact_rest(CONTACT_ARGUMENTS) {
    __shared__ level::ContactShared shared;
    const BatchOrder order = batch_order_of(&shape, &arrays);
    const int blocks = (int)gridDim.x, from_end = blocks - 1 - (int)blockIdx.x;
    int at = (int)blockIdx.x, stride = blocks, count = shape.robots, is_left = 0;
    for (;;) {
        const int turn = at < count ? __ldcg(is_left ? &order.left[at] : &order.list[at]) : -1;
        const int is_robot = turn >= 0 && (is_left || is_both(turn));
        if (is_robot && IS_STEPPED(turn / 4)) {
            CONTACT_ROBOT(level, &shared, turn / 4, 0, NULL)
        }
        at += stride; /* of the same chunk: behind a robot of a pair there are no others */
        if (!is_robot) {
            if (is_left || from_end >= LEFT_BLOCKS) {
                break;
            }
            kernel_wait();
            is_left = 1;
            count = __ldcg(order.count);
            at = from_end;
            stride = blocks < LEFT_BLOCKS ? blocks : LEFT_BLOCKS;
        }
    }
}
#endif

static __global__ void __launch_bounds__(LANES, MAP_ROBOTS) contact_map(CONTACT_ARGUMENTS) {
    __shared__ map::ContactShared shared;
    if (IS_STEPPED(blockIdx.x)) {
        CONTACT_ROBOT(map, &shared, (int)blockIdx.x, 0, NULL)
    }
    if (arrays.beside && blockIdx.x == 0) {
        kernel_wait();
    }
}

static MildStatus step(const MildBatch *batch, const MildBatchInput *input,
                       const MildBatchOutput *output, int advance, MildStream stream,
                       MildError *error) {
    const BatchShape *shape = &batch->shape;
    ContactSetup setup;
    OnDevice on(batch->device);
    batch_setup(shape, &batch->arrays, &setup);
    cudaLaunchAttribute beside = {};
    beside.id = cudaLaunchAttributeProgrammaticStreamSerialization;
    beside.val.programmaticStreamSerializationAllowed = 1;
    cudaLaunchConfig_t config = {};
    config.gridDim = dim3((unsigned)shape->robots);
    config.blockDim = dim3(LANES);
    config.stream = (cudaStream_t)stream;
    config.attrs = &beside;
    const int lets_go = device_lets_go(batch->device);
    config.numAttrs = batch->arrays.beside && lets_go ? 1 : 0;
    auto run = shape->map ? contact_map : contact_level;
#if KERNEL_PAIRS
    if (batch_pairs(batch)) { /* half of each chunk: pairs; robots, with as many behind them */
        const int chunks = (shape->robots + ORDER_ROBOTS - 1) / ORDER_ROBOTS;
        const int half = ((shape->robots + chunks - 1) / chunks + 1) / 2;
        config.gridDim = dim3((unsigned)chunks, (unsigned)half);
        config.numAttrs = lets_go ? 1 : 0;
        cudaLaunchKernelEx(&config, contact_pairs, setup, *shape, batch->arrays, *input, *output,
                           advance);
        config.gridDim = dim3((unsigned)(half * chunks));
        run = contact_rest;
    }
#endif
    cudaLaunchKernelEx(&config, run, setup, *shape, batch->arrays, *input, *output, advance);
    return checked(cudaGetLastError(), "step", error);
}

extern "C" {
extern const BatchKernel KERNEL;
const BatchKernel KERNEL = {KERNEL_GROUPS,
                            KERNEL_PER,
                            KERNEL_POINTS,
                            (int)KERNEL_CURVES == (int)LAW_ANY   ? ~0
                            : (int)KERNEL_CURVES == (int)LAW_ALL ? ~LAW_HEAP
                                                                 : KERNEL_CURVES,
                            KERNEL_PAIRS,
                            step};
}
