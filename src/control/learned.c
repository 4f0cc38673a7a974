#include <stdlib.h>
#include <string.h>

#include "control/controller.h"
#include "learn/policy.h"

typedef struct {
    Policy *policy;
    Pool *pool;
    int rows_max;
    float *history; /* [rows_max][TASK_HISTORY] */
} Learned;

static void learned_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    Learned *learned = self;
    for (int i = 0; i < rows; i++) {
        memcpy(learned->history + (size_t)i * TASK_HISTORY, envs[i]->history,
               sizeof envs[i]->history);
    }
    policy_act(learned->policy, learned->pool, rows, learned->history, actions, NULL, NULL);
}

static void learned_destroy(void *self) {
    Learned *learned = self;
    policy_destroy(learned->policy);
    free(learned->history);
    free(learned);
}

MildStatus controller_learned(const char *path, Pool *pool, int rows_max, Controller *controller,
                              MildError *error) {
    Policy *policy = policy_load(path, NULL, 0, error);
    if (!policy) {
        return error ? error->status : MILD_ERROR_FORMAT;
    }
    const PolicyDef *def = policy_def(policy);
    if (def->observation != TASK_OBSERVATION || def->frames != TASK_FRAMES ||
        def->actions != TASK_ACTIONS) {
        mild_fail(error, MILD_ERROR_FORMAT,
                  "%s: a policy for %d observations x %d frames and %d actions; this task needs %d "
                  "x %d and %d",
                  path, def->observation, def->frames, def->actions, TASK_OBSERVATION, TASK_FRAMES,
                  TASK_ACTIONS);
        policy_destroy(policy);
        return MILD_ERROR_FORMAT;
    }
    Learned *learned = calloc(1, sizeof *learned);
    float *history = calloc((size_t)rows_max * TASK_HISTORY, sizeof *history);
    if (!learned || !history) {
        free(learned);
        free(history);
        policy_destroy(policy);
        return mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
    }
    *learned = (Learned){policy, pool, rows_max, history};
    *controller = (Controller){learned, "learned", learned_act, learned_destroy};
    return MILD_OK;
}

void controller_destroy(Controller *controller) {
    if (controller->self) {
        controller->destroy(controller->self);
        controller->self = NULL;
    }
}
