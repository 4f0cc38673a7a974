#include <stdlib.h>
#include <string.h>

#include "control/controller.h"
#include "learn/policy.h"

typedef struct {
    Policy *policy;
    Pool *pool;
    int rows_max;
    size_t width;   /* of a history */
    float *history; /* [rows_max][width] */
} Learned;

static void learned_act_on(void *self, int rows, const float *history, float *actions) {
    Learned *learned = self;
    policy_act(learned->policy, learned->pool, rows, history, actions, NULL, NULL);
}

static void learned_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    Learned *learned = self;
    for (int i = 0; i < rows; i++) {
        memcpy(learned->history + (size_t)i * learned->width, task_env_history(envs[i]),
               learned->width * sizeof *learned->history);
    }
    learned_act_on(self, rows, learned->history, actions);
}

static void learned_destroy(void *self) {
    Learned *learned = self;
    policy_destroy(learned->policy);
    free(learned->history);
    free(learned);
}

MildStatus controller_learned(const char *path, const Robot *robot, Pool *pool, int rows_max,
                              Controller *controller, MildError *error) {
    TaskShape shape = task_shape(robot);
    Policy *policy = policy_load(path, NULL, 0, error);
    if (!policy) {
        return error ? error->status : MILD_ERROR_FORMAT;
    }
    const PolicyDef *def = policy_def(policy);
    if (def->robot[0] && strcmp(def->robot, robot_name(robot)) != 0) {
        mild_fail(
            error, MILD_ERROR_FORMAT,
            "%s: this policy is for robot %s, not for %s; give --robot %s or another --policy",
            path, def->robot, robot_name(robot), def->robot);
        policy_destroy(policy);
        return MILD_ERROR_FORMAT;
    }
    if (def->observation != shape.observation || def->frames != TASK_FRAMES ||
        def->actions != shape.actions || def->estimates != shape.estimates) {
        mild_fail(
            error, MILD_ERROR_FORMAT,
            "%s: a policy for %d observations x %d frames and %d actions, %d estimates; robot "
            "%s needs %d x %d and %d, %d",
            path, def->observation, def->frames, def->actions, def->estimates, robot_name(robot),
            shape.observation, TASK_FRAMES, shape.actions, shape.estimates);
        policy_destroy(policy);
        return MILD_ERROR_FORMAT;
    }
    Learned *learned = calloc(1, sizeof *learned);
    float *history = calloc((size_t)rows_max * (size_t)shape.history, sizeof *history);
    if (!learned || !history) {
        free(learned);
        free(history);
        policy_destroy(policy);
        return mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
    }
    *learned = (Learned){policy, pool, rows_max, (size_t)shape.history, history};
    *controller = (Controller){learned, "learned", learned_act, learned_destroy, learned_act_on};
    return MILD_OK;
}

MildStatus controller_make_learned(const ControllerDef *def, Controller *controller,
                                   MildError *error) {
    return controller_learned(def->policy, def->robot, def->pool, def->rows_max, controller, error);
}
