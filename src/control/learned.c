#include "control/learned.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "base/text.h"
#include "learn/policy.h"

typedef struct {
    Policy *policy;
    Pool *pool;
    int rows_max;
    size_t width;         /* of a history */
    size_t frame;         /* of one of its frames */
    float *history;       /* [rows_max][width] */
    LearnedInside inside; /* estimates; the others of a watched one, else NULL */
    float *seen;          /* memory of the others, then of the means */
    PolicyInstead instead;
    int newest; /* bool: the older frames are the newest one */
} Learned;

static void learned_act_on(void *self, int rows, const float *history, float *actions) {
    Learned *learned = self;
    assert(rows <= learned->rows_max);
    policy_act(learned->policy, learned->pool, rows, history, actions,
               learned->inside.rows.estimates, NULL);
}

/* The newest frame over the older ones of a history. */
static void forget(const Learned *learned, float *history) {
    const size_t frame = learned->frame;
    for (int i = 0; i < TASK_FRAMES - 1; i++) {
        memcpy(history + (size_t)i * frame, history + (TASK_FRAMES - 1) * frame,
               frame * sizeof *history);
    }
}

static void learned_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    Learned *learned = self;
    for (int i = 0; i < rows; i++) {
        float *history = learned->history + (size_t)i * learned->width;
        memcpy(history, task_env_history(envs[i]), learned->width * sizeof *history);
        if (learned->newest) {
            forget(learned, history);
        }
    }
    policy_act_inside(learned->policy, learned->pool, rows, learned->history, &learned->instead,
                      actions, &learned->inside.rows);
}

static const float *learned_estimates(void *self, int row) {
    const Learned *learned = self;
    return learned->inside.rows.estimates + (size_t)row * (size_t)learned->inside.estimates;
}

static void learned_destroy(void *self) {
    Learned *learned = self;
    policy_destroy(learned->policy);
    free(learned->history);
    free(learned->inside.rows.estimates);
    free(learned->seen);
    free(learned);
}

/* ---- inside ---- */

MildStatus ablation_find(const char *name, Ablation *ablation, MildError *error) {
#define ABLATION_NAME(name, what) #name,
    static const char *const names[ABLATIONS] = {ABLATION_LIST(ABLATION_NAME)};
#undef ABLATION_NAME
    const int found = text_find(name, names, ABLATIONS);
    if (found > ABLATION_none) {
        *ablation = (Ablation)found;
        return MILD_OK;
    }
    return mild_fail(error, MILD_ERROR_ARGUMENT, "--ablate: unknown part '%.60s'; nearest is '%s'",
                     name, text_nearest(name, (const char **)names + 1, ABLATIONS - 1));
}

int ablation_has_means(Ablation ablation) {
    return ablation == ABLATION_z || ablation == ABLATION_estimates ||
           ablation == ABLATION_modulation;
}

MildStatus learned_watch(Controller *controller, const LearnedInside **inside, MildError *error) {
    Learned *learned = controller->self;
    if (controller->act != learned_act) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "controller %s has no networks to look into; give --controller learned",
                         controller->name);
    }
    LearnedInside *seen = &learned->inside;
    const PolicyDef *def = policy_def(learned->policy);
    const size_t rows = (size_t)learned->rows_max, latent = (size_t)def->latent,
                 estimates = (size_t)def->estimates, theta = (size_t)policy_theta(learned->policy);
    if (!learned->seen) {
        learned->seen =
            calloc(rows * (2 * latent + theta) + latent + estimates + theta, sizeof *learned->seen);
    }
    if (!learned->seen) {
        return mild_fail(error, MILD_ERROR_MEMORY, "controller: out of memory for %d rows",
                         learned->rows_max);
    }
    seen->latent = def->latent;
    seen->theta = (int)theta;
    seen->rows.latent = learned->seen;
    seen->rows.modulated = seen->rows.latent + rows * latent;
    seen->rows.theta = seen->rows.modulated + rows * latent;
    *inside = seen;
    return MILD_OK;
}

void learned_ablate(Controller *controller, Ablation ablation, const float *means) {
    Learned *learned = controller->self;
    const LearnedInside *seen = &learned->inside;
    const size_t latent = (size_t)seen->latent, estimates = (size_t)seen->estimates;
    const size_t bytes = (latent + estimates + (size_t)seen->theta) * sizeof *means;
    float *kept = seen->rows.theta + (size_t)learned->rows_max * (size_t)seen->theta;
    PolicyInstead *instead = &learned->instead;
    memset(instead, 0, sizeof *instead);
    learned->newest = ablation == ABLATION_history;
    if (ablation_has_means(ablation)) {
        memcpy(kept, means, bytes);
        instead->latent = ablation == ABLATION_z ? kept : NULL;
        instead->estimates = ablation == ABLATION_estimates ? kept + latent : NULL;
        instead->theta = ablation == ABLATION_modulation ? kept + latent + estimates : NULL;
    }
}

/* ---- creation ---- */

Policy *learned_policy(const char *path, const TaskDef *task, const Robot *robot, char *note,
                       int note_size, MildError *error) {
    const TaskShape shape = task_shape(task, robot);
    Policy *policy = policy_load(path, note, note_size, error);
    if (!policy) {
        return NULL;
    }
    const PolicyDef *def = policy_def(policy);
    if (def->robot[0] && strcmp(def->robot, robot_name(robot)) != 0) {
        mild_fail(
            error, MILD_ERROR_FORMAT,
            "%s: this policy is for robot %s, not for %s; give --robot %s or another --policy",
            path, def->robot, robot_name(robot), def->robot);
        policy_destroy(policy);
        return NULL;
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
        return NULL;
    }
    if (def->scan != shape.scan) {
        mild_fail(error, MILD_ERROR_FORMAT,
                  "%s: this policy sees %d points of the ground and the task has %d (task.scan, "
                  "scan_ahead, scan_pitch); leave these keys to the policy's file",
                  path, def->scan, shape.scan);
        policy_destroy(policy);
        return NULL;
    }
    return policy;
}

MildStatus controller_make_learned(const ControllerDef *def, Controller *controller,
                                   MildError *error) {
    const TaskShape shape = task_shape(def->task, def->robot);
    const char *path = def->policy;
    const int rows_max = def->rows_max;
    MildError inner = {0};
    Policy *policy = learned_policy(path, def->task, def->robot, NULL, 0, &inner);
    if (!policy) {
        return mild_fail(error, inner.status, "%s", inner.text);
    }
    Learned *learned = calloc(1, sizeof *learned);
    float *history = calloc((size_t)rows_max * (size_t)shape.history, sizeof *history);
    float *estimates = calloc((size_t)rows_max * (size_t)shape.estimates, sizeof *estimates);
    if (!learned || !history || !estimates) {
        free(learned);
        free(history);
        free(estimates);
        policy_destroy(policy);
        return mild_fail(error, MILD_ERROR_MEMORY, "%s: out of memory", path);
    }
    *learned =
        (Learned){.policy = policy,
                  .pool = def->pool,
                  .rows_max = rows_max,
                  .width = (size_t)shape.history,
                  .frame = (size_t)shape.observation,
                  .history = history,
                  .inside = {.estimates = shape.estimates, .rows = {.estimates = estimates}}};
    *controller = (Controller){.self = learned,
                               .name = "learned",
                               .act = learned_act,
                               .destroy = learned_destroy,
                               .act_on = learned_act_on,
                               .estimates = learned_estimates};
    return MILD_OK;
}

MildStatus controller_learned(const char *path, const Robot *robot, Pool *pool, int rows_max,
                              Controller *controller, MildError *error) {
    const TaskDef task = task_def_default();
    const ControllerDef def = {path, &task, robot, pool, rows_max};
    return controller_make_learned(&def, controller, error);
}
