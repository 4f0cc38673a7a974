/* The batch on the CPU: the code of the GPU, robot after robot. */
#define CONTACT_MAP 0
#include "ground/batch/host.inc"

_Static_assert(sizeof(ContactMaterial) == sizeof(MaterialNumbers), "the same numbers");
_Static_assert(sizeof(ContactFoot) == sizeof(MildBatchFoot), "the same numbers");
_Static_assert(CONTACT_FEET_MAX == MILD_BATCH_PLANES_MAX, "the same number");

HostRobot host_robot(const BatchShape *shape) {
    return shape->map ? host_robot_map(shape) : host_kind(shape);
}

void host_step(const BatchShape *shape, const BatchArrays *arrays, const MildBatchInput *input,
               const MildBatchOutput *output, int advance) {
    const HostRobot step = host_robot(shape);
    ContactSetup setup = {.feet = 0};
    batch_setup(shape, arrays, &setup);
    for (int robot = 0; robot < shape->robots; robot++) {
        ContactProblem problem;
        ContactResult result;
        if (arrays->skip && arrays->skip[robot]) {
            continue;
        }
        batch_problem(shape, arrays, input, robot, &problem);
        batch_result(shape, output, robot, &result);
        step(&setup, &problem, batch_memory(shape, arrays, robot), advance, &result);
    }
}
