/* The contact step of a batch on a GPU: a warp a robot, or two. cmake/Batch.cmake makes a unit of
 * each size. Before the inclusion: KERNEL, the name of what it gives; KERNEL_GROUPS, KERNEL_PER,
 * KERNEL_POINTS, KERNEL_CURVES and KERNEL_HEAP, what they are for (contact.inc); KERNEL_ROBOTS of
 * a multiprocessor; KERNEL_PAIRS, 1 where a warp may have two robots of which one foot is in the
 * air. */
#define MILD_REAL_FLOAT
#define REAL_FORGETS /* what is no number shows in the forces */

extern "C" {
#include "ground/batch/batch.h"
}

#include "device/cuda.h"
#include "ground/batch/contact.h"

#define CONTACT_CURVES KERNEL_CURVES
#define CONTACT_HEAP KERNEL_HEAP
#define CONTACT_POINTS KERNEL_POINTS
#define CONTACT_MAP 0
#define CONTACT_FEET KERNEL_GROUPS
#define CONTACT_PER KERNEL_PER
#define CONTACT(name) level_##name
#include "ground/batch/contact.inc"
#undef CONTACT_MAP
#define CONTACT_MAP 1
#define CONTACT_FEET KERNEL_GROUPS
#define CONTACT_PER KERNEL_PER
#define CONTACT(name) map_##name
#include "ground/batch/contact.inc"
#if KERNEL_PAIRS
#undef CONTACT_MAP
#define CONTACT_MAP 0
#define CONTACT_PAIRS 1
#define CONTACT_FEET KERNEL_GROUPS
#define CONTACT_PER KERNEL_PER
#define CONTACT(name) pair_##name
#include "ground/batch/contact.inc"
#endif
#include "ground/batch/robot.inc"

static_assert(sizeof(ContactMaterial) == sizeof(MaterialNumbers), "the same numbers");
static_assert(sizeof(ContactFoot) == sizeof(MildBatchFoot), "the same numbers");

/* A block has one robot: one that takes long keeps no other's place. With a map and a share an
 * element has more numbers than there is shared memory for on sixteen robots. */
#define MAP_ROBOTS (KERNEL_HEAP && KERNEL_ROBOTS > 12 ? 12 : KERNEL_ROBOTS)
#define CONTACT_ARGUMENTS                                                                          \
    const __grid_constant__ ContactSetup setup, const __grid_constant__ BatchShape shape,          \
        const __grid_constant__ BatchArrays arrays, const __grid_constant__ MildBatchInput input,  \
        const __grid_constant__ MildBatchOutput output, int advance
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
        version##_robot(&setup, &problem, shared, &memory, advance, &result, done);                \
        __syncwarp(); /* for `shared` */                                                           \
    }

static __global__ void __launch_bounds__(LANES, KERNEL_ROBOTS) contact_level(CONTACT_ARGUMENTS) {
    __shared__ level_Shared shared;
    if (IS_STEPPED(blockIdx.x)) {
        CONTACT_ROBOT(level, &shared, (int)blockIdx.x, 0, NULL)
    }
    if (arrays.beside && blockIdx.x == 0) {
        kernel_wait();
    }
}

#if KERNEL_PAIRS
/* The robots at two places in a row of the order: as a pair, or else one after the other. */
static __global__ void __launch_bounds__(LANES, KERNEL_ROBOTS) contact_pairs(CONTACT_ARGUMENTS) {
    __shared__ union {
        level_Shared level;
        pair_Shared pair;
    } shared;
    if (!arrays.beside) {
        kernel_wait(); /* for order.cu */
    }
    const int place = 2 * (int)blockIdx.x + (int)threadIdx.x / (LANES / 2);
    const int turn = place < shape.robots ? arrays.order[place] : -1;
    int waits = turn >= 0 && IS_STEPPED(turn / 4);
    if (__all_sync(~0u, waits && turn % 4 != 3)) {
        int done;
        CONTACT_ROBOT(pair, &shared.pair, turn / 4, turn % 4 / 2, &done)
        waits = !done;
    }
    LANE_ROLLED
    for (int k = 0; k < 2; k++) {
        if (__shfl_sync(~0u, waits, LANES / 2 * k)) {
            const int robot = __shfl_sync(~0u, turn, LANES / 2 * k) / 4;
            CONTACT_ROBOT(level, &shared.level, robot, 0, NULL)
        }
    }
    if (arrays.beside && blockIdx.x == 0) {
        kernel_wait();
    }
}
#else
#define contact_pairs contact_level
#endif

static __global__ void __launch_bounds__(LANES, MAP_ROBOTS) contact_map(CONTACT_ARGUMENTS) {
    __shared__ map_Shared shared;
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
    const int pairs = batch_pairs(batch);
    config.gridDim = dim3((unsigned)(pairs ? (shape->robots + 1) / 2 : shape->robots));
    config.blockDim = dim3(LANES);
    config.stream = (cudaStream_t)stream;
    config.attrs = &beside;
    const int waits = batch->arrays.beside || pairs;
    config.numAttrs = waits && device_lets_go(batch->device) ? 1 : 0;
    const auto run = shape->map ? contact_map : pairs ? contact_pairs : contact_level;
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
