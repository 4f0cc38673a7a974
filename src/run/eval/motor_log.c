#include "run/eval/motor_log.h"

#include <math.h>
#include <stdlib.h>

#include "env/actuator/record.h"

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

MildStatus motor_log(const MotorLogDef *def, int *falls, MildError *error) {
    Recorder recorder = {.motors = def->motors,
                         .joints = robot_joints(def->robot),
                         .dt = def->task->physics_dt,
                         .csv = def->csv};
    Recorder *const self = &recorder;
    const TaskActuator recorded = {&self, def->motors->bytes, torque_recorded};
    const TaskView none = {0};
    TaskDef task = *def->task;
    float action[ROBOT_JOINTS_MAX];
    task.motors = &recorded;
    *falls = 0;
    TaskEnv *env = aligned_alloc(64, task_env_bytes(&task, def->robot));
    if (!env) {
        return mild_fail(error, MILD_ERROR_MEMORY, "log: out of memory");
    }
    RobotSim *sim = robot_sim_create(def->robot, task.physics_dt, error);
    if (!sim) {
        free(env);
        return error->status;
    }
    record_print_header(def->robot, def->csv);
    task_env_init(env, &task, def->robot, def->seed, 0);
    task_env_reset(env, &task, def->robot, sim, &none);
    for (int step = 0; step < (int)(def->seconds / TASK_PERIOD + 0.5); step++) {
        def->controller->act(def->controller->self, 1, &env, action);
        shake(def, step, action);
        const TaskStep out = task_env_step(env, &task, def->robot, sim, action, 1, &none, NULL);
        *falls += out.done && !out.timeout;
        recorder.time += out.done ? EPISODE_GAP : 0;
    }
    robot_sim_destroy(sim);
    free(env);
    return MILD_OK;
}
