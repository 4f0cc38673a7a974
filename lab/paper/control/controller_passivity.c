/* The passivity-based walk as a controller (README.md): the plan of walk.h, the whole
 * body of body.h. Torques are computed at every physics step from the true state. */
#include <stdlib.h>
#include <string.h>

#include "lab/lists.h"
#include "paper/control/body.h"
#include "paper/control/walk.h"

/* One environment's walk. */
typedef struct {
    Walk walk;
    WalkState state;
    Body *body;
    int fresh; /* bool: the episode has just begun */
    int first; /* bool: the first physics step of a policy step, before which forces are unknown */
} Row;

typedef struct {
    WalkDef def;
    int joints;
    int rows;
    Row row[];
} Passivity;

/* The actions stay 0: only torques move the robot. */
static void passivity_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    Passivity *passivity = self;
    for (int e = 0; e < rows; e++) {
        Row *row = &passivity->row[e];
        row->fresh = envs[e]->step == envs[e]->step_first;
        row->first = 1;
    }
    memset(actions, 0, (size_t)(rows * passivity->joints) * sizeof *actions);
}

static void passivity_torque(void *self, int row, const TaskEnv *env, RobotSim *sim,
                             double *torque) {
    Passivity *passivity = self;
    Row *r = &passivity->row[row];
    WalkTarget target;
    body_measure(r->body, sim, passivity->def.b, &r->state);
    for (int f = 0; f < WALK_FEET && !r->first; f++) {
        r->state.force[f] = robot_sim_foot(sim, f)->force[2];
    }
    r->first = 0;
    if (r->fresh) {
        memset(r->state.force, 0, sizeof r->state.force);
        walk_start(&r->walk, &passivity->def, &r->state);
        r->fresh = 0;
    }
    walk_advance(&r->walk, &passivity->def, &r->state, env->command, robot_sim_dt(sim));
    walk_target(&r->walk, &passivity->def, &r->state, &target);
    body_torque(r->body, &target, passivity->def.b, torque);
}

static void passivity_destroy(void *self) {
    Passivity *passivity = self;
    for (int i = 0; i < passivity->rows; i++) {
        body_destroy(passivity->row[i].body);
    }
    free(passivity);
}

MildStatus controller_make_passivity(const ControllerDef *def, Controller *controller,
                                     MildError *error) {
    const BodyDef body = body_def_default();
    TaskGains gains;
    MildStatus status = task_gains(def->task, def->robot, &gains, error);
    if (status != MILD_OK) {
        return status;
    }
    Passivity *passivity =
        calloc(1, sizeof *passivity + (size_t)def->rows_max * sizeof *passivity->row);
    if (!passivity) {
        return mild_fail(error, MILD_ERROR_MEMORY, "controller passivity: out of memory");
    }
    passivity->def = walk_def_default();
    passivity->joints = robot_joints(def->robot);
    passivity->rows = def->rows_max;
    for (int i = 0; i < def->rows_max; i++) {
        passivity->row[i].body = body_create(def->robot, &body, gains.limit, error);
        if (!passivity->row[i].body) {
            passivity_destroy(passivity);
            return error->status;
        }
    }
    *controller = (Controller){.self = passivity,
                               .name = "passivity",
                               .act = passivity_act,
                               .destroy = passivity_destroy,
                               .torque = passivity_torque};
    return MILD_OK;
}
