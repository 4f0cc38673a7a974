/* The controllers by name. */
#include <stdlib.h>
#include <string.h>

#include "base/text.h"
#include "control/controller.h"

#ifdef MILD_LAB
#include "lab/lists.h"
#else
#define LAB_CONTROLLERS(X)
#endif

#define ROW(name, properties, summary) {#name, summary, properties, controller_make_##name},
static const struct {
    const char *name, *summary;
    int properties;
    MildStatus (*make)(const ControllerDef *def, Controller *controller, MildError *error);
} controllers[] = {CONTROLLER_LIST(ROW) LAB_CONTROLLERS(ROW)};
#undef ROW
enum { CONTROLLERS = sizeof controllers / sizeof *controllers };

int controller_count(void) {
    return CONTROLLERS;
}

const char *controller_name(int index) {
    return controllers[index].name;
}

const char *controller_summary(int index) {
    return controllers[index].summary;
}

int controller_has(const char *name, int property) {
    int has = 0;
    for (int i = 0; i < CONTROLLERS; i++) {
        has |= controllers[i].properties & property && strcmp(name, controllers[i].name) == 0;
    }
    return has;
}

MildStatus controller_check(const char *name, MildError *error) {
    const char *names[CONTROLLERS];
    for (int i = 0; i < CONTROLLERS; i++) {
        names[i] = controllers[i].name;
        if (strcmp(name, names[i]) == 0) {
            return MILD_OK;
        }
    }
    return mild_fail(error, MILD_ERROR_ARGUMENT, "unknown controller '%.60s'; nearest is '%s'",
                     name, text_nearest(name, names, CONTROLLERS));
}

MildStatus controller_make(const char *name, const ControllerDef *def, Controller *controller,
                           MildError *error) {
    for (int i = 0; i < CONTROLLERS; i++) {
        if (strcmp(name, controllers[i].name) != 0) {
            continue;
        }
        if (def->task->motors && (controllers[i].properties & CONTROLLER_OWN_GAINS)) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "task.actuator has no effect on controller %s, which has gains or "
                             "torques of its own; leave out one of them",
                             name);
        }
        return controllers[i].make(def, controller, error);
    }
    return controller_check(name, error);
}

static void row_torque(void *row, const TaskEnv *env, RobotSim *sim, double *torque) {
    const ControllerRow *r = row;
    r->controller->torque(r->controller->self, r->row, env, sim, torque);
}

TaskDrive controller_drive(ControllerRow *row) {
    return (TaskDrive){row_torque, row};
}

const float *controller_estimates(const Controller *controller, int row) {
    return controller->estimates ? controller->estimates(controller->self, row) : NULL;
}

SpeedHoldDef speed_hold_def(const TaskDef *task, const Robot *robot, const Controller *controller) {
    return (SpeedHoldDef){.gain = controller->estimates ? task->speed_hold : 0,
                          .scale = task->velocity_scale,
                          .most = task->speed_hold_most,
                          .clock = task_shape(task, robot).observation - 2};
}

void controller_destroy(Controller *controller) {
    if (controller->self) {
        controller->destroy(controller->self);
        controller->self = NULL;
    }
}

/* ---- takes no action. The joints hold the default pose with the task's gains ---- */

static void zero_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    const int *width = self;
    (void)envs;
    for (int i = 0; i < rows * *width; i++) {
        actions[i] = 0;
    }
}

MildStatus controller_make_zero(const ControllerDef *def, Controller *controller,
                                MildError *error) {
    int *width = malloc(sizeof *width);
    if (!width) {
        return mild_fail(error, MILD_ERROR_MEMORY, "zero: out of memory");
    }
    *width = robot_actions(def->robot);
    *controller = (Controller){.self = width, .name = "zero", .act = zero_act, .destroy = free};
    return MILD_OK;
}
