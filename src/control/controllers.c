/* The controllers by name. */
#include <string.h>

#include "base/text.h"
#include "control/controller.h"

#define ROW(name, follows, summary) {#name, summary, follows, controller_make_##name},
static const struct {
    const char *name, *summary;
    int follows; /* bool */
    MildStatus (*make)(const ControllerDef *def, Controller *controller, MildError *error);
} controllers[] = {CONTROLLER_LIST(ROW)};
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

int controller_follows(const char *name) {
    int follows = 0;
    for (int i = 0; i < CONTROLLERS; i++) {
        follows |= controllers[i].follows && strcmp(name, controllers[i].name) == 0;
    }
    return follows;
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
        if (def->task->motors && (strcmp(name, "stand") == 0 || strcmp(name, "passivity") == 0)) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "task.actuator has no effect on controller %s, which has gains or "
                             "torques of its own; leave out one of them",
                             name);
        }
        return controllers[i].make(def, controller, error);
    }
    return controller_check(name, error);
}

void controller_row_torque(void *row, const TaskEnv *env, RobotSim *sim, double *torque) {
    const ControllerRow *r = row;
    r->controller->torque(r->controller->self, r->row, env, sim, torque);
}

void controller_destroy(Controller *controller) {
    if (controller->self) {
        controller->destroy(controller->self);
        controller->self = NULL;
    }
}
