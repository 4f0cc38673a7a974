/* The rival "Clock" (Singh et al. 2024, Robust Humanoid Walking on Compliant and Uneven Terrain
 * with Deep Reinforcement Learning): a network of two hidden layers that sees the newest frame
 * alone, with its gait clock. It decides 40 times a second, so a decision lasts two and three
 * policy periods in turn, and the action moves half the way to each new one. Trained by
 * lab/paper/rivals/train_clock.py, whose files it reads.
 *
 * It remembers nothing: the period of an episode and the present action are the environment's. */
#include <stdlib.h>
#include <string.h>

#include "lab/lists.h"
#include "learn/product.h"
#include "paper/control/weights.h"

enum { CLOCK_LAYERS = 3, CLOCK_PERIODS = 5 };
#define CLOCK_SMOOTHING 0.5F /* [-] share of the new action */

typedef struct {
    Weights *weights;
    Linear layer[CLOCK_LAYERS]; /* frame -> hidden -> hidden -> action */
    float *hidden[2];           /* of one row */
    int observation, joints;
} Clock;

/* Bool: a decision begins in this period of the episode: 0, 2, 5, 7, 10 ... */
static int clock_is_due(const TaskEnv *env) {
    const uint32_t period = (env->step - env->step_first) % CLOCK_PERIODS;
    return period == 0 || period == 2;
}

static void rectify(float *x, int count) {
    for (int i = 0; i < count; i++) {
        x[i] = x[i] > 0 ? x[i] : 0;
    }
}

static void clock_decide(const Clock *clock, const float *frame, const float *last, float *action) {
    const Linear *layer = clock->layer;
    linear_apply(&layer[0], 1, frame, clock->hidden[0]);
    rectify(clock->hidden[0], layer[0].out);
    linear_apply(&layer[1], 1, clock->hidden[0], clock->hidden[1]);
    rectify(clock->hidden[1], layer[1].out);
    linear_apply(&layer[2], 1, clock->hidden[1], action);
    for (int i = 0; i < clock->joints; i++) {
        action[i] = CLOCK_SMOOTHING * action[i] + (1 - CLOCK_SMOOTHING) * last[i];
    }
}

static void clock_act(void *self, int rows, TaskEnv *const *envs, float *actions) {
    const Clock *clock = self;
    const int entered = product_enter(0);
    for (int r = 0; r < rows; r++) {
        float *action = actions + r * clock->joints;
        const float *last = envs[r]->action[0];
        if (clock_is_due(envs[r])) {
            const float *frame = task_env_frame(envs[r]);
            clock_decide(clock, frame, last, action);
        } else {
            memcpy(action, last, (size_t)clock->joints * sizeof *action);
        }
    }
    product_leave(entered);
}

static void clock_destroy(void *self) {
    Clock *clock = self;
    if (clock) {
        weights_destroy(clock->weights);
        free(clock->hidden[0]);
        free(clock);
    }
}

static MildStatus clock_take(Clock *clock, MildError *error) {
    Weights *weights = clock->weights;
    const int first = weights_length(weights, "actor.0.weight", 0),
              second = weights_length(weights, "actor.2.weight", 0);
    clock->layer[0] = weights_take_linear(weights, "actor.0", clock->observation, first);
    clock->layer[1] = weights_take_linear(weights, "actor.2", first, second);
    clock->layer[2] = weights_take_linear(weights, "actor.4", second, clock->joints);
    if (weights_status(weights, error) != MILD_OK) {
        return error->status;
    }
    clock->hidden[0] = calloc((size_t)first + (size_t)second, sizeof *clock->hidden[0]);
    clock->hidden[1] = clock->hidden[0] + first;
    return clock->hidden[0] ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "clock: out of memory");
}

MildStatus controller_make_clock(const ControllerDef *def, Controller *controller,
                                 MildError *error) {
    MildError cause = {0};
    Clock *clock = calloc(1, sizeof *clock);
    if (!clock) {
        return mild_fail(error, MILD_ERROR_MEMORY, "clock: out of memory");
    }
    clock->observation = task_shape(def->task, def->robot).observation;
    clock->joints = robot_actions(def->robot);
    clock->weights = weights_read(def->policy, "mild clock", "lab/paper/rivals/train_clock.py",
                                  robot_name(def->robot), &cause);
    if (!clock->weights || clock_take(clock, &cause) != MILD_OK) {
        clock_destroy(clock);
        return mild_fail(error, cause.status, "%s", cause.text);
    }
    *controller =
        (Controller){.self = clock, .name = "clock", .act = clock_act, .destroy = clock_destroy};
    return MILD_OK;
}
