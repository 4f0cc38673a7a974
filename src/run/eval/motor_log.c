#include "run/eval/motor_log.h"

#include <math.h>
#include <stdlib.h>

#include "env/actuator/record.h"
#include "env/envs.h"

#define SHAKE_TIME 2.0 /* [s] after which amplitudes and frequencies are drawn anew */
#define SHAKE_SLOWEST 0.5
#define SHAKE_FASTEST 8.0 /* [Hz] */
#define EPISODE_GAP 1.0   /* [s] */
#define RANDOM_USE_SHAKE 0x5348414bu
#define TWO_PI 6.283185307179586

/* Motors that write what passes. */
typedef struct {
    const TaskActuator *motors;
    int joints;
    double dt, time; /* [s] */
    FILE *csv;
} Recorder;

static void torque_recorded(const void *self, void *state, const double *error, const double *speed,
                            double *torque) {
    Recorder *recorder = *(Recorder *const *)self;
    recorder->motors->torque(recorder->motors->self, state, error, speed, torque);
    record_print_row(recorder->joints, recorder->time, error, speed, torque, recorder->csv);
    recorder->time += recorder->dt;
}

/* A sine for each joint, with an amplitude and a frequency for SHAKE_TIME. */
static void shake(const MotorLogDef *def, int step, float *action) {
    const int period = (int)(SHAKE_TIME / TASK_PERIOD);
    const double time = step % period * TASK_PERIOD;
    for (int i = 0; i < robot_joints(def->robot); i++) {
        Random r = random_at(def->seed ^ RANDOM_USE_SHAKE, (uint32_t)i, (uint32_t)(step / period));
        const double size = def->shake * random_unit(&r);
        const double rate = SHAKE_SLOWEST * pow(SHAKE_FASTEST / SHAKE_SLOWEST, random_unit(&r));
        action[i] += (float)(size * sin(TWO_PI * rate * time) /
                             task_action_scale(def->task, robot_table(def->robot)));
    }
}

/* The controller's steps of one environment. falls: counted. */
static MildStatus walk(const MotorLogDef *def, Envs *envs, Recorder *recorder, int *falls,
                       MildError *error) {
    float action[ROBOT_JOINTS_MAX], reward;
    uint8_t done = 0, timeout = 0, valid;
    const EnvsStep step = {
        .action = action, .reward = &reward, .done = &done, .timeout = &timeout, .valid = &valid};
    TaskEnv *env = envs_env(envs, 0);
    MildStatus status = envs_reset(envs, &(EnvsView){0}, NULL, error);
    for (int k = 0; status == MILD_OK && k < (int)(def->seconds / TASK_PERIOD + 0.5); k++) {
        def->controller->act(def->controller->self, 1, &env, action);
        shake(def, k, action);
        status = envs_step(envs, &step, NULL, error);
        *falls += done && !timeout;
        recorder->time += done ? EPISODE_GAP : 0;
    }
    return status;
}

MildStatus motor_log(const MotorLogDef *def, int *falls, MildError *error) {
    Recorder recorder = {.motors = def->motors,
                         .joints = robot_joints(def->robot),
                         .dt = def->task->physics_dt,
                         .csv = def->csv};
    Recorder *const self = &recorder;
    const TaskActuator recorded = {&self, def->motors->bytes, torque_recorded};
    TaskDef task = *def->task;
    task.motors = &recorded;
    *falls = 0;
    Pool *pool = pool_create(1);
    if (!pool) {
        return mild_fail(error, MILD_ERROR_MEMORY, "log: out of memory");
    }
    const EnvsDef of = {
        .task = &task, .robot = def->robot, .pool = pool, .count = 1, .seed = def->seed};
    Envs *envs = envs_create(&of, error);
    MildStatus status = envs ? MILD_OK : error->status;
    if (status == MILD_OK) {
        record_print_header(def->robot, def->csv);
        status = walk(def, envs, &recorder, falls, error);
    }
    envs_destroy(envs);
    pool_destroy(pool);
    return status;
}
