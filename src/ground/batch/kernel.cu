/* The contact step of a batch on a GPU: a warp a robot. cmake/Batch.cmake makes a unit of each
 * size. Before the inclusion: KERNEL, the name of what it gives; KERNEL_GROUPS, KERNEL_PER,
 * KERNEL_POINTS and KERNEL_CURVES, what they are for (contact.inc); KERNEL_ROBOTS of a
 * multiprocessor. */
#define MILD_REAL_FLOAT
#define REAL_FORGETS /* what is no number shows in the forces */

extern "C" {
#include "ground/batch/batch.h"
}

#include "device/cuda.h"
#include "ground/batch/contact.h"
#include "ground/batch/contact_shapes.h"

enum {
    CONTACT_FEET = KERNEL_GROUPS,
    CONTACT_PER = KERNEL_PER,
    CONTACT_CURVES = KERNEL_CURVES,
    CONTACT_POINTS = KERNEL_POINTS
};
namespace level {
enum { CONTACT_MAP = 0 };
#include "ground/batch/contact.inc"
} // namespace level
namespace map {
enum { CONTACT_MAP = 1 };
#include "ground/batch/contact.inc"
} // namespace map
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
/* The robot of a block, if it is among those of a step. */
#define CONTACT_ROBOT(version)                                                                     \
    __shared__ version::ContactShared shared;                                                      \
    const int robot = (int)blockIdx.x;                                                             \
    if (!(arrays.skip && arrays.skip[robot])) {                                                    \
        ContactProblem problem;                                                                    \
        ContactResult result;                                                                      \
        const ContactMemory memory = batch_memory(&shape, &arrays, robot);                         \
        batch_problem(&shape, &arrays, &input, robot, &problem);                                   \
        batch_result(&shape, &output, robot, &result);                                             \
        version::contact_robot(&setup, &problem, &shared, &memory, advance, &result);              \
    }                                                                                              \
    if (arrays.beside && robot == 0) {                                                             \
        kernel_wait();                                                                             \
    }

static __global__ void __launch_bounds__(LANES, KERNEL_ROBOTS) contact_level(CONTACT_ARGUMENTS) {
    CONTACT_ROBOT(level)
}

static __global__ void __launch_bounds__(LANES, MAP_ROBOTS) contact_map(CONTACT_ARGUMENTS) {
    CONTACT_ROBOT(map)
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
    config.numAttrs = batch->arrays.beside && device_lets_go(batch->device) ? 1 : 0;
    auto run = shape->map ? contact_map : contact_level;
    cudaLaunchKernelEx(&config, run, setup, *shape, batch->arrays, *input, *output, advance);
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
