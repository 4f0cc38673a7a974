/* The batch on the CPU: the text of the GPU, robot after robot. */
#define MILD_REAL_FLOAT

#include "batch/batch.h"
#include "batch/contact_kinds.h"

_Static_assert(sizeof(ContactMaterial) == sizeof(MaterialNumbers), "the same numbers");
_Static_assert(sizeof(ContactFoot) == sizeof(MildBatchFoot), "the same numbers");

#include "batch/robot.inc"

size_t batch_memory_numbers(const BatchShape *shape) {
    return (size_t)CONTACT_MEMORY * (size_t)shape->groups * (size_t)shape->stride;
}

#define HOST_KIND(groups, per)                                                                     \
    static void host_robot_##groups##_##per(const ContactSetup *setup,                             \
                                            const ContactProblem *problem, Real *memory,           \
                                            int advance, const ContactResult *result) {            \
        contact_Shared_##groups##_##per shared;                                                    \
        contact_robot_##groups##_##per(setup, problem, &shared, memory, advance, result);          \
    }
CONTACT_KINDS(HOST_KIND)

typedef void (*HostRobot)(const ContactSetup *setup, const ContactProblem *problem, Real *memory,
                          int advance, const ContactResult *result);

static HostRobot host_robot(const BatchShape *shape) {
#define HOST_CHOICE(g, p)                                                                          \
    if (shape->groups == (g) && shape->per == (p)) {                                               \
        return host_robot_##g##_##p;                                                               \
    }
    CONTACT_KINDS(HOST_CHOICE)
    return NULL;
}

void host_step(const BatchShape *shape, const BatchArrays *arrays, const MildBatchInput *input,
               const MildBatchOutput *output, int advance) {
    const HostRobot step = host_robot(shape);
    ContactSetup setup = {.feet = 0};
    batch_setup(shape, arrays, &setup);
    for (long robot = 0; robot < shape->robots; robot++) {
        ContactProblem problem;
        ContactResult result;
        batch_problem(shape, arrays, input, robot, &problem);
        batch_result(shape, output, robot, &result);
        step(&setup, &problem, batch_memory(shape, arrays, robot), advance, &result);
    }
}
