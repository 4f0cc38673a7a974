/* The batch on the CPU: the code of the GPU, robot after robot. */
#define MILD_REAL_FLOAT

#include "ground/batch/bodies_robot.h"

#include "ground/batch/bodies_batch.h"
#include "ground/batch/contact_shapes.h"
#include "ground/batch/robot.inc"

_Static_assert(sizeof(ContactMaterial) == sizeof(MaterialNumbers), "the same numbers");
_Static_assert(sizeof(ContactFoot) == sizeof(MildBatchFoot), "the same numbers");
_Static_assert(CONTACT_FEET_MAX == MILD_BATCH_PLANES_MAX, "the same number");

/* The version for these soles, as batch_kernel on a GPU. */
static HostRobot *host_robot(const BatchShape *shape) {
#define HOST_POINTS(g, p)                                                                          \
    if (shape->points && shape->groups == (g) && shape->per == (p)) {                              \
        return shape->map ? host_points_map : host_points;                                         \
    }
    CONTACT_POINT_KINDS(HOST_POINTS)
    return shape->map ? host_feet_map : host_feet;
}

void host_step(const BatchShape *shape, const BatchArrays *arrays, const MildBatchInput *input,
               const MildBatchOutput *output, int advance) {
    HostRobot *const step = host_robot(shape);
    ContactSetup setup = {.feet = 0};
    batch_setup(shape, arrays, &setup);
    for (int robot = 0; robot < shape->robots; robot++) {
        ContactProblem problem;
        ContactResult result;
        if (arrays->skip && arrays->skip[robot]) {
            continue;
        }
        const ContactMemory memory = batch_memory(shape, arrays, robot);
        batch_problem(shape, arrays, input, robot, &problem);
        batch_result(shape, output, robot, &result);
        step(&setup, &problem, &memory, advance, &result);
    }
}

/* ---- a step with shells ---- */

void host_bodies_begin(const BodiesCall *call) {
    for (long robot = 0; robot < call->shape.robots; robot++) {
        bodies_find(call, robot);
    }
}

void host_bodies_end(const BodiesCall *call) {
    BodiesWork work;
    for (long robot = 0; robot < call->shape.robots; robot++) {
        if (call->bodies.near[robot]) {
            bodies_solve(call, robot, &work, LAW_ANY);
        } else {
            bodies_rest(call, robot);
        }
    }
}
