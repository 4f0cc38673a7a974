/* The contact step of a batch on a GPU: a warp a robot. cmake/Batch.cmake makes a unit of each
 * size. Before the inclusion: KERNEL, the name of what it gives; KERNEL_GROUPS, KERNEL_PER,
 * KERNEL_POINTS, KERNEL_CURVES and KERNEL_HEAP, what they are for (contact.inc); KERNEL_ROBOTS of
 * a multiprocessor. */
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
#include "ground/batch/robot.inc"

static_assert(sizeof(ContactMaterial) == sizeof(MaterialNumbers), "the same numbers");
static_assert(sizeof(ContactFoot) == sizeof(MildBatchFoot), "the same numbers");

/* A block has one robot: one that takes long keeps no other's place. With a map and a share an
 * element has more numbers than there is shared memory for on sixteen robots. */
#define MAP_ROBOTS (KERNEL_HEAP && KERNEL_ROBOTS > 12 ? 12 : KERNEL_ROBOTS)
#define CONTACT_TURN(version, robots)                                                              \
    static __global__ void __launch_bounds__(LANES, robots) contact_##version(                     \
        const __grid_constant__ ContactSetup setup, const __grid_constant__ BatchShape shape,      \
        const __grid_constant__ BatchArrays arrays, const __grid_constant__ MildBatchInput input,  \
        const __grid_constant__ MildBatchOutput output, int advance) {                             \
        __shared__ version##_Shared shared;                                                        \
        const int robot = (int)blockIdx.x;                                                         \
        if (!(arrays.skip && arrays.skip[robot])) {                                                \
            ContactProblem problem;                                                                \
            ContactResult result;                                                                  \
            batch_problem(&shape, &arrays, &input, robot, &problem);                               \
            batch_result(&shape, &output, robot, &result);                                         \
            version##_robot(&setup, &problem, &shared, batch_memory(&shape, &arrays, robot),       \
                            advance, &result);                                                     \
        }                                                                                          \
        if (arrays.beside && robot == 0) {                                                         \
            kernel_wait();                                                                         \
        }                                                                                          \
    }
CONTACT_TURN(level, KERNEL_ROBOTS)
CONTACT_TURN(map, MAP_ROBOTS)

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
    config.numAttrs = batch->arrays.beside && device_lets_go(batch->device) ? 1 : 0;
    cudaLaunchKernelEx(&config, shape->map ? contact_map : contact_level, setup, *shape,
                       batch->arrays, *input, *output, advance);
    return checked(cudaGetLastError(), "step", error);
}

extern "C" {
extern const BatchKernel KERNEL;
const BatchKernel KERNEL = {KERNEL_GROUPS, KERNEL_PER, KERNEL_POINTS,
                            (int)KERNEL_CURVES == (int)LAW_ANY   ? ~0
                            : (int)KERNEL_CURVES == (int)LAW_ALL ? ~LAW_HEAP
                                                                 : KERNEL_CURVES,
                            step};
}
