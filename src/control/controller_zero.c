/* Takes no action. The joints hold the default pose with the task's gains. */
#include <stdlib.h>

#include "control/controller.h"

static void zero_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    const int *joints = self;
    (void)envs;
    for (int i = 0; i < rows * *joints; i++) {
        actions[i] = 0;
    }
}

MildStatus controller_make_zero(const ControllerDef *def, Controller *controller,
                                MildError *error) {
    int *joints = malloc(sizeof *joints);
    if (!joints) {
        return mild_fail(error, MILD_ERROR_MEMORY, "zero: out of memory");
    }
    *joints = robot_joints(def->robot);
    *controller = (Controller){.self = joints, .name = "zero", .act = zero_act, .destroy = free};
    return MILD_OK;
}
