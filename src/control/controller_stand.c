/* The balanced stand as a controller, which ignores the command. The balance is computed once per
 * policy step from the true state. Between policy steps the joints' own PD holds it. */
#include <stdlib.h>
#include <string.h>

#include "control/controller.h"
#include "control/stand.h"

typedef struct {
    const Robot *robot;
    Stand *stand;
    RobotSim *sim;       /* to compute the feet of a state */
    double action_scale; /* [rad] per unit of action */
} Standing;

/* Gains are part of a motor command, so the environments get the gains of the stand. */
static void standing_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    Standing *standing = self;
    int joints = robot_joints(standing->robot);
    size_t bytes = (size_t)joints * sizeof(double);
    const double *pose = robot_default_pose(standing->robot);
    for (int e = 0; e < rows; e++) {
        double target[ROBOT_JOINTS_MAX];
        memcpy(task_env_rest(envs[e])->gains.kp, robot_stand_kp(standing->robot), bytes);
        memcpy(task_env_rest(envs[e])->gains.kd, robot_stand_kd(standing->robot), bytes);
        task_env_load(envs[e], standing->sim);
        stand_target(standing->stand, standing->sim, target);
        for (int i = 0; i < joints; i++) {
            actions[e * joints + i] = (float)((target[i] - pose[i]) / standing->action_scale);
        }
    }
}

static void standing_destroy(void *self) {
    Standing *standing = self;
    robot_sim_destroy(standing->sim);
    stand_destroy(standing->stand);
    free(standing);
}

MildStatus controller_make_stand(const ControllerDef *def, Controller *controller,
                                 MildError *error) {
    Standing *standing = calloc(1, sizeof *standing);
    if (!standing) {
        return mild_fail(error, MILD_ERROR_MEMORY, "stand: out of memory");
    }
    standing->robot = def->robot;
    standing->action_scale = task_action_scale(def->task, robot_table(def->robot));
    standing->stand = stand_create(def->robot, error);
    standing->sim = robot_sim_create(def->robot, def->task->physics_dt, error);
    if (!standing->stand || !standing->sim) {
        standing_destroy(standing);
        return mild_fail(error, MILD_ERROR_MEMORY, "stand: out of memory");
    }
    *controller = (Controller){
        .self = standing, .name = "stand", .act = standing_act, .destroy = standing_destroy};
    return MILD_OK;
}
