#include "env/actuator/actuator.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "env/actuator/private.h"
#include "learn/vector.h"

/* ---- creation ---- */

int actuator_kinds(const Robot *robot, int *kind) {
    const double *numbers[] = {robot_kp(robot), robot_kd(robot), robot_effort(robot),
                               robot_speed(robot)};
    int kinds = 0;
    for (int i = 0; i < robot_joints(robot); i++) {
        kind[i] = -1;
        for (int k = 0; k < i && kind[i] < 0; k++) {
            int same = 1;
            for (int n = 0; n < 4; n++) {
                same = same && numbers[n][k] == numbers[n][i];
            }
            kind[i] = same ? kind[k] : -1;
        }
        kind[i] = kind[i] < 0 ? kinds++ : kind[i];
    }
    return kinds;
}

static const int hidden[POLICY_LAYERS_MAX] = {ACTUATOR_HIDDEN, ACTUATOR_HIDDEN};

Mlp actuator_mlp(void) {
    Mlp mlp;
    mlp_layout(&mlp, ACTUATOR_INPUTS, hidden, 1, 0);
    mlp.activation = MLP_SOFTSIGN;
    return mlp;
}

int actuator_parameters(void) {
    Mlp mlp;
    return (int)mlp_layout(&mlp, ACTUATOR_INPUTS, hidden, 1, 0);
}

static int name_joints(Actuator *actuator, const Robot *robot) {
    size_t used = 0;
    for (int i = 0; i < actuator->joint_count; i++) {
        const size_t room = sizeof actuator->joints - used;
        const int length = snprintf(actuator->joints + used, room, "%s%s", i ? " " : "",
                                    robot_joint_name(robot, i));
        if (length < 0 || (size_t)length >= room) {
            return 0;
        }
        used += (size_t)length;
    }
    return snprintf(actuator->robot, sizeof actuator->robot, "%s", robot_name(robot)) <
           (int)sizeof actuator->robot;
}

Actuator *actuator_create(const Robot *robot, double spacing, MildError *error) {
    const size_t count = (size_t)actuator_parameters();
    Actuator *actuator = calloc(1, sizeof *actuator);
    int made = actuator != NULL;
    if (actuator) {
        actuator->spacing = spacing;
        actuator->joint_count = robot_joints(robot);
        actuator->kinds = actuator_kinds(robot, actuator->kind);
    }
    for (int k = 0; actuator && k < actuator->kinds; k++) {
        ActuatorNet *net = &actuator->net[k];
        net->scale = (ActuatorScale){1, 1, 1};
        net->parameters = calloc(count, sizeof(float));
        net->forward = calloc(count, sizeof(float));
        made = made && net->parameters && net->forward;
    }
    if (!made) {
        mild_fail(error, MILD_ERROR_MEMORY, "actuator: out of memory");
    } else if (!name_joints(actuator, robot)) {
        made = 0;
        mild_fail(error, MILD_ERROR_RANGE,
                  "actuator: a name of the robot or its joints is longer "
                  "than 63 characters");
    }
    if (!made) {
        actuator_destroy(actuator);
        return NULL;
    }
    return actuator;
}

void actuator_destroy(Actuator *actuator) {
    for (int k = 0; actuator && k < actuator->kinds; k++) {
        free(actuator->net[k].parameters);
        free(actuator->net[k].forward);
    }
    free(actuator);
}

void actuator_set(Actuator *actuator, int kind, ActuatorScale scale, const float *parameters) {
    ActuatorNet *net = &actuator->net[kind];
    const Mlp mlp = actuator_mlp();
    net->scale = scale;
    memcpy(net->parameters, parameters, (size_t)actuator_parameters() * sizeof *parameters);
    for (int l = 0; l < mlp.layers; l++) {
        const MlpLayer *layer = &mlp.layer[l];
        for (int i = 0; i < layer->in; i++) {
            for (int o = 0; o < layer->out; o++) {
                net->forward[layer->weight + (int64_t)i * layer->out + o] =
                    parameters[layer->weight + (int64_t)o * layer->in + i];
            }
        }
        memcpy(net->forward + layer->bias, parameters + layer->bias,
               (size_t)layer->out * sizeof *parameters);
    }
}

/* ---- torque ---- */

/* y = W^T x + b of a hidden layer, softsign. weight: [in][ACTUATOR_HIDDEN], then b. */
static void layer_forward(const float *restrict weight, int in, const float *restrict x,
                          float *restrict y) {
    memcpy(y, weight + (size_t)in * ACTUATOR_HIDDEN, ACTUATOR_HIDDEN * sizeof *y);
    for (int i = 0; i < in; i++) {
        for (int o = 0; o < ACTUATOR_HIDDEN; o++) {
            y[o] += weight[i * ACTUATOR_HIDDEN + o] * x[i];
        }
    }
    for (int o = 0; o < ACTUATOR_HIDDEN; o++) {
        y[o] = vector_softsign(y[o]);
    }
}

double actuator_torque(const Actuator *actuator, int joint, const double *error,
                       const double *speed) {
    const ActuatorNet *net = &actuator->net[actuator->kind[joint]];
    float x[ACTUATOR_INPUTS], first[ACTUATOR_HIDDEN], second[ACTUATOR_HIDDEN];
    for (int t = 0; t < ACTUATOR_TIMES; t++) {
        x[t] = (float)(error[t] / net->scale.error);
        x[ACTUATOR_TIMES + t] = (float)(speed[t] / net->scale.speed);
    }
    const float *at = net->forward;
    layer_forward(at, ACTUATOR_INPUTS, x, first);
    at += (ACTUATOR_INPUTS + 1) * ACTUATOR_HIDDEN;
    layer_forward(at, ACTUATOR_HIDDEN, first, second);
    at += (ACTUATOR_HIDDEN + 1) * ACTUATOR_HIDDEN;
    float sum = at[ACTUATOR_HIDDEN];
    for (int i = 0; i < ACTUATOR_HIDDEN; i++) {
        sum += at[i] * second[i];
    }
    return net->scale.torque * (double)sum;
}

/* ---- in the task ---- */

/* The state of an environment: `count` physics steps since the episode began, and the last
 * 2 lag + 1 of them as a ring of rows, [joints] errors and [joints] speeds. Before the episode a
 * joint is taken to have been as in its first step. */
typedef struct {
    int64_t count;
    double rows[];
} NetworkMemory;

static double *memory_row(const Actuator *actuator, NetworkMemory *memory, int64_t step) {
    const int64_t held = (ACTUATOR_TIMES - 1) * actuator->lag + 1;
    return memory->rows + (step > 0 ? step % held : 0) * 2 * actuator->joint_count;
}

static void torque_of_joints(const void *self, void *state, const double *error,
                             const double *speed, double *torque) {
    const Actuator *actuator = self;
    NetworkMemory *memory = state;
    const int joints = actuator->joint_count;
    const int64_t now = memory->count++;
    double *row = memory_row(actuator, memory, now);
    memcpy(row, error, (size_t)joints * sizeof *row);
    memcpy(row + joints, speed, (size_t)joints * sizeof *row);
    for (int i = 0; i < joints; i++) {
        double errors[ACTUATOR_TIMES], speeds[ACTUATOR_TIMES];
        for (int t = 0; t < ACTUATOR_TIMES; t++) {
            const double *then = memory_row(actuator, memory, now - (int64_t)t * actuator->lag);
            errors[t] = then[i];
            speeds[t] = then[joints + i];
        }
        torque[i] = actuator_torque(actuator, i, errors, speeds);
    }
}

/* Sets task->motors, which borrow the actuator. */
static MildStatus use(Actuator *actuator, TaskDef *task, MildError *error) {
    const double lag = actuator->spacing / task->physics_dt;
    const int rows = (ACTUATOR_TIMES - 1) * (int)lround(lag) + 1;
    if (!(fabs(lag - round(lag)) < 1e-6 && lag > 0.5)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "task.actuator = %.100s: its history of %g s is not a whole multiple of "
                         "task.physics_dt = %g",
                         task->actuator, actuator->spacing, task->physics_dt);
    }
    if (strcmp(task->kp, "robot") != 0 || strcmp(task->kd, "robot") != 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "task.actuator = %.100s takes the place of the PD, so task.kp and task.kd "
                         "have no effect; leave them at robot",
                         task->actuator);
    }
    actuator->lag = (int)lround(lag);
    const size_t bytes =
        sizeof(NetworkMemory) + (size_t)rows * 2 * (size_t)actuator->joint_count * sizeof(double);
    actuator->motors = (TaskActuator){
        .self = actuator, .bytes = (bytes + 63) / 64 * 64, .torque = torque_of_joints};
    task->motors = &actuator->motors;
    return MILD_OK;
}

MildStatus actuator_open(TaskDef *task, const Robot *robot, Actuator **actuator, MildError *error) {
    MildError cause = {0};
    *actuator = NULL;
    if (!task->actuator[0]) {
        return MILD_OK;
    }
    *actuator = actuator_load(task->actuator, robot, &cause);
    return *actuator ? use(*actuator, task, error)
                     : mild_fail(error, cause.status, "task.actuator: %s", cause.text);
}
