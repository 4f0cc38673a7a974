/* Trials as one set of environments, by MuJoCo or by the batch engine. A policy step is one step of
 * all, and one copy of what the host needs of it. */
#include "run/eval/eval.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/text.h"
#include "control/speed_hold.h"
#include "device/device.h"
#include "env/envs.h"
#include "run/eval/actions.h"
#include "run/eval/track.h"

#define HEADING_GAIN 1.0  /* [1/s] */
#define HEADING_LIMIT 0.5 /* [rad/s] */
#define PUSH_INTERVAL 4.0 /* [s] */
#define LED_MOST 10.0     /* [m/s] */
#define RANDOM_USE_PUSH 0x45505553u
#define TWO_PI 6.283185307179586

/* ---- commands and pushes ---- */

static void hold_heading(const double quaternion[4], double speed, double sideways,
                         double command[TASK_COMMANDS]) {
    const double turn = -HEADING_GAIN * measure_yaw(quaternion);
    command[0] = speed;
    command[1] = sideways;
    command[2] = speed == 0 && sideways == 0 ? 0 : fmin(fmax(turn, -HEADING_LIMIT), HEADING_LIMIT);
    command[TASK_RISE] = 0;
}

/* The command at a time of a trial [s] for a robot with the orientation `quaternion` (w x y z):
 * that of eval_command, with `turn` where it is not 0, and none from the stop on. A robot that is
 * to jump stands first, so that its rise has a measure, and then holds its heading. */
static void direct(const EvalDef *eval, double speed, double time, const double quaternion[4],
                   double command[TASK_COMMANDS]) {
    const int stands = eval->jump > 0 && time < MEASURE_SETTLED;
    if (stands || (eval->stop > 0 && time >= eval->stop)) {
        hold_heading(quaternion, 0, 0, command);
        return;
    }
    hold_heading(quaternion, speed, eval->sideways, command);
    if (eval->turn != 0) {
        command[2] = eval->turn;
    }
    command[TASK_RISE] = eval->jump;
}

void eval_command(TaskEnv *env, double speed, double sideways) {
    env->command_frozen = 1;
    hold_heading(env->robot.qpos + 3, speed, sideways, env->command);
}

/* A push in a random direction every PUSH_INTERVAL, each trial's at other times. */
static void push_trial(TaskEnv *env, double speed) {
    const uint32_t interval = (uint32_t)(PUSH_INTERVAL / TASK_PERIOD + 0.5);
    if (speed == 0 || (env->step + env->index * 97u) % interval != 0) {
        return;
    }
    Random r = random_at(env->seed ^ RANDOM_USE_PUSH, env->index, env->tick);
    const double angle = TWO_PI * random_unit(&r);
    env->robot.qvel[0] += speed * cos(angle);
    env->robot.qvel[1] += speed * sin(angle);
}

/* ---- trials ---- */

/* What the environments write in a policy step, one block where they are and its copy here. */
typedef struct {
    EnvsSample *sample; /* [trials][samples] */
    float *history;     /* [trials][TaskShape.history] */
    float *reward;      /* [trials] */
    uint8_t *done, *timeout, *valid, *cause;
} Results;

typedef struct {
    const EvalRun *run;
    TaskDef task;
    MildTerrain *terrain; /* [scenes] */
    EnvsTrial *trial;     /* [trials] */
    Envs *envs;
    TaskEnv **env;    /* [trials] by MuJoCo, else NULL */
    int rows, trials; /* trials of all rows */
    int samples;      /* physics steps of a policy step */
    size_t bytes;     /* of the block */
    void *device_block, *block;
    float *device_action; /* [trials][joints] on the device */
    Results device, host;
    float *action;   /* [trials][joints] */
    double *command; /* [trials][TASK_COMMANDS] */
    double *heard;   /* [trials] [m/s] with EvalDef.led */
    SpeedHoldDef speed_hold;
    SpeedHold *hold;                   /* [trials] */
    Measure *measure;                  /* [trials] */
    TaskMotor motor[ROBOT_JOINTS_MAX]; /* limits */
    uint8_t *end;                      /* [trials] TaskEnd; TASK_END_time while it walks */
    Track track;                       /* if EvalDef.track is given */
    Feet feet;                         /* if EvalDef.feet is given */
} Trials;

static int row_of(const Trials *t, int trial) {
    return trial / t->run->eval.trials;
}

static double speed_of(const Trials *t, int trial) {
    return t->run->speeds[row_of(t, trial) % t->run->speed_count];
}

static const Scene *scene_of(const Trials *t, int trial) {
    return &t->run->scenes[row_of(t, trial) / t->run->speed_count];
}

/* Bool: it fell or diverged. */
static int is_over(const Trials *t, int trial) {
    return t->end[trial] != TASK_END_time;
}

/* ---- creation ---- */

/* What only MuJoCo has. */
static MildStatus check_batch(const EvalRun *run, MildError *error) {
    const int rows = run->scene_count * run->speed_count;
    if (!run->controller->act_on) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--controller %s reads what the batch engine does not hand over; give "
                         "--train.robots=mujoco",
                         run->controller->name);
    }
    if (run->eval.trials > EVAL_ROBOTS_MAX / rows) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--trials %d of %d rows are more than %d robots at once; ask for fewer, "
                         "or give --train.robots=mujoco",
                         run->eval.trials, rows, EVAL_ROBOTS_MAX);
    }
    for (int i = 0; i < run->scene_count; i++) {
        if (run->scenes[i].terrain.material_count > 1) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "--ground %s: the batch engine has no courses; give "
                             "--train.robots=mujoco, or single grounds",
                             run->scenes[i].name);
        }
    }
    return MILD_OK;
}

static MildStatus fail_memory(const Trials *t, MildError *error) {
    return mild_fail(error, MILD_ERROR_MEMORY, "evaluation: out of memory for %d trials",
                     t->trials);
}

static MildStatus open_envs(Trials *t, MildError *error) {
    const EvalRun *run = t->run;
    const Controller *controller = run->controller;
    t->terrain = calloc((size_t)run->scene_count, sizeof *t->terrain);
    t->trial = calloc((size_t)t->trials, sizeof *t->trial);
    if (!t->terrain || !t->trial) {
        return fail_memory(t, error);
    }
    for (int i = 0; i < run->scene_count; i++) {
        t->terrain[i] = run->scenes[i].terrain;
    }
    for (int i = 0; i < t->trials; i++) {
        const Scene *scene = scene_of(t, i);
        t->trial[i] = (EnvsTrial){.stream = (uint32_t)(i % run->eval.trials),
                                  .ground = (int)(scene - run->scenes),
                                  .rigid = scene->rigid};
    }
    const EnvsDef envs = {.task = &t->task,
                          .robot = run->robot,
                          .pool = run->pool,
                          .batch = run->batch,
                          .device = run->device,
                          .count = t->trials,
                          .seed = run->eval.seed,
                          .trial = t->trial,
                          .terrain = t->terrain,
                          .terrains = run->scene_count,
                          .drive = {controller->torque, controller->self},
                          .ground = run->ground};
    t->envs = envs_create(&envs, error);
    return t->envs ? MILD_OK : error->status;
}

static MildStatus take_limits(Trials *t, MildError *error) {
    const RobotTable *table = robot_table(t->run->robot);
    TaskGains gains;
    const MildStatus status = task_gains(&t->task, t->run->robot, &gains, error);
    for (int i = 0; i < table->joints; i++) {
        t->motor[i] = (TaskMotor){
            .limit = gains.limit[i], .fastest = table->speed[i], .full = table->full_speed[i]};
    }
    return status;
}

static Results carve(const Trials *t, void *block) {
    const size_t trials = (size_t)t->trials;
    Results at;
    at.sample = block;
    at.history = (float *)(void *)(at.sample + trials * (size_t)t->samples);
    at.reward = at.history + trials * (size_t)task_shape(&t->task, t->run->robot).history;
    at.done = (uint8_t *)(at.reward + trials);
    at.timeout = at.done + trials;
    at.valid = at.timeout + trials;
    at.cause = at.valid + trials;
    return at;
}

static MildStatus open_arrays(Trials *t, MildError *error) {
    const size_t trials = (size_t)t->trials, actions = (size_t)robot_actions(t->run->robot);
    const size_t history = (size_t)task_shape(&t->task, t->run->robot).history;
    t->samples = envs_physics_steps(t->envs);
    t->bytes = trials * ((size_t)t->samples * sizeof(EnvsSample) + (history + 1) * sizeof(float) +
                         4 * sizeof(uint8_t));
    t->block = calloc(1, t->bytes);
    t->action = calloc(trials * actions, sizeof *t->action);
    t->command = calloc(trials, TASK_COMMANDS * sizeof *t->command);
    t->heard = calloc(trials, sizeof *t->heard);
    t->hold = calloc(trials, sizeof *t->hold);
    t->measure = calloc(trials, sizeof *t->measure);
    t->end = calloc(trials, 1);
    t->env = t->run->batch ? NULL : calloc(trials, sizeof *t->env);
    if (!t->block || !t->action || !t->command || !t->heard || !t->hold || !t->measure || !t->end ||
        (!t->env && !t->run->batch)) {
        return fail_memory(t, error);
    }
    for (int i = 0; t->env && i < t->trials; i++) {
        t->env[i] = envs_env(t->envs, i);
    }
    t->device_block = device_alloc(t->run->device, t->bytes, error);
    if (t->device_block) {
        t->device_action = device_alloc(t->run->device, trials * actions * sizeof(float), error);
    }
    if (!t->device_action) {
        return MILD_ERROR_MEMORY;
    }
    t->device = carve(t, t->device_block);
    t->host = carve(t, t->block);
    return MILD_OK;
}

static void close_trials(Trials *t) {
    device_free(t->run->device, t->device_block);
    device_free(t->run->device, t->device_action);
    envs_destroy(t->envs);
    free(t->terrain);
    free(t->trial);
    free(t->env);
    free(t->block);
    free(t->action);
    free(t->command);
    free(t->heard);
    free(t->hold);
    measure_free(t->measure, t->trials);
    free(t->end);
    track_free(&t->track);
    feet_free(&t->feet);
}

/* ---- steps ---- */

static void start_trial(void *context, int trial, int thread) {
    static const double ahead[4] = {1, 0, 0, 0};
    Trials *t = context;
    Measure *measure = &t->measure[trial];
    (void)thread;
    measure_start(measure, t->task.physics_dt);
    measure->steady_end = t->run->eval.stop;
    measure->keep = t->run->eval.stances != NULL;
    measure->motor = t->motor;
    measure->nominal_height = robot_nominal_height(t->run->robot);
    direct(&t->run->eval, speed_of(t, trial), 0, ahead, t->command + TASK_COMMANDS * (size_t)trial);
}

/* [observation] What the policy sees next. */
static const float *newest_frame(const Trials *t, int trial) {
    const TaskShape shape = task_shape(&t->task, t->run->robot);
    return t->host.history + (size_t)(trial + 1) * (size_t)shape.history - shape.scan -
           shape.observation;
}

/* after: the last physics step. */
static void take_smooth(Trials *t, int trial, const EnvsSample *after) {
    const Controller *controller = t->run->controller;
    const int actions = robot_actions(t->run->robot);
    const float *action = t->action + (size_t)trial * (size_t)actions;
    smooth_take(&t->measure[trial].smooth, MEASURE_SETTLED, TASK_PERIOD, after, actions,
                controller->torque ? NULL : action,
                task_action_scale(&t->task, robot_table(t->run->robot)), t->task.action_clip);
}

/* Measures the policy step, and says where to go in the next one. */
static void take_trial(void *context, int trial, int thread) {
    Trials *t = context;
    const EvalDef *eval = &t->run->eval;
    const EnvsSample *first = t->host.sample + (size_t)trial * (size_t)t->samples, *at = first;
    double *command;
    (void)thread;
    if (is_over(t, trial)) {
        return;
    }
    while (at < first + t->samples && at->valid) {
        if (eval->feet) {
            feet_take(&t->feet, trial, at);
        }
        measure_sample(&t->measure[trial], at++);
    }
    t->end[trial] = t->host.done[trial] ? t->host.cause[trial] : TASK_END_time;
    if (is_over(t, trial)) {
        return;
    }
    if (eval->track) {
        track_take(&t->track, trial, at - 1);
    }
    take_smooth(t, trial, at - 1);
    command = t->command + TASK_COMMANDS * (size_t)trial;
    direct(eval, eval->led ? t->heard[trial] : speed_of(t, trial), t->measure[trial].time,
           (at - 1)->quaternion, command);
    speed_hold(&t->hold[trial], &t->speed_hold, newest_frame(t, trial),
               controller_estimates(t->run->controller, trial), command);
    if (t->env) {
        push_trial(t->env[trial], eval->push);
    }
}

/* Of each trial that goes on: tells in a line its number, the time [s], and of each foot the ankle
 * 3 [m] and the load [N], and hears in another the speed to command next [m/s]. */
static MildStatus hear_speed(Trials *t, double time, MildError *error) {
    for (int i = 0; i < t->trials; i++) {
        const EnvsSample *last = t->host.sample + (size_t)(i + 1) * (size_t)t->samples - 1;
        char line[64] = "";
        if (is_over(t, i) || t->host.done[i]) {
            continue;
        }
        printf("%d %.2f", i, time);
        for (int f = 0; f < last->feet; f++) {
            const double *at = last->foot[f].position;
            printf(" %.6g %.6g %.6g %.6g", at[0], at[1], at[2], last->foot[f].load);
        }
        printf("\n");
        if (fflush(stdout) != 0 || !fgets(line, sizeof line, stdin)) {
            return mild_fail(error, MILD_ERROR_IO, "--led: nobody says how fast to go");
        }
        const size_t end = strcspn(line, "\n");
        const int whole = line[end] == '\n';
        line[end] = 0;
        if (!whole || !text_double(line, &t->heard[i]) || fabs(t->heard[i]) > LED_MOST) {
            return mild_fail(error, MILD_ERROR_IO, "--led: '%s' is no speed", line);
        }
    }
    return MILD_OK;
}

/* Shows to who watches what the controller has decided. */
static void show_decisions(const Trials *t, int step) {
    const EvalDef *eval = &t->run->eval;
    for (int i = 0; t->env && i < t->trials; i++) {
        const EvalDecision decision = {.task = &t->task,
                                       .scene = scene_of(t, i),
                                       .speed = speed_of(t, i),
                                       .trial = i,
                                       .time = step * TASK_PERIOD,
                                       .env = t->env[i],
                                       .action = t->action + i * robot_actions(t->run->robot)};
        if (eval->callback && !is_over(t, i)) {
            eval->callback->decided(eval->callback->context, &decision);
        }
        if (eval->actions && !is_over(t, i)) {
            actions_print_row(eval->actions, &decision);
        }
    }
}

static MildStatus start(Trials *t, MildError *error) {
    const EnvsView first = {.history = t->device.history};
    pool_run(t->run->pool, t->trials, start_trial, t);
    envs_set_samples(t->envs, t->device.sample);
    MildStatus status = envs_set_commands(t->envs, t->command, error);
    status = status == MILD_OK ? envs_reset(t->envs, &first, NULL, error) : status;
    return status == MILD_OK
               ? device_copy(t->run->device, t->block, t->device_block, t->bytes, error)
               : status;
}

static MildStatus step(Trials *t, int step, MildError *error) {
    const EvalRun *run = t->run;
    const Controller *controller = run->controller;
    const size_t bytes = (size_t)t->trials * (size_t)robot_actions(run->robot) * sizeof *t->action;
    const EnvsStep call = {.action = t->device_action,
                           .reward = t->device.reward,
                           .done = t->device.done,
                           .timeout = t->device.timeout,
                           .valid = t->device.valid,
                           .cause = t->device.cause,
                           .next = {.history = t->device.history}};
    if (t->env) {
        controller->act(controller->self, t->trials, t->env, t->action);
    } else {
        controller->act_on(controller->self, t->trials, t->host.history, t->action);
    }
    show_decisions(t, step);
    MildStatus status = device_copy(run->device, t->device_action, t->action, bytes, error);
    status = status == MILD_OK ? envs_step(t->envs, &call, NULL, error) : status;
    if (status == MILD_OK) {
        status = device_copy(run->device, t->block, t->device_block, t->bytes, error);
    }
    if (status == MILD_OK && run->eval.led) {
        status = hear_speed(t, (step + 1) * TASK_PERIOD, error);
    }
    if (status == MILD_OK) {
        pool_run(run->pool, t->trials, take_trial, t);
        status = envs_set_commands(t->envs, t->command, error);
    }
    return status;
}

/* ---- the run ---- */

static MildStatus summarise(Trials *t, EvalRow *rows, MildError *error) {
    EvalDef eval = t->run->eval;
    MildStatus status = MILD_OK;
    eval.start = t->task.start;
    for (int row = 0; row < t->rows && status == MILD_OK; row++) {
        const int first = row * eval.trials;
        eval.speed = speed_of(t, first);
        status =
            eval_summarise(&rows[row], scene_of(t, first)->name, &eval, t->measure + first,
                           t->end + first, robot_total_mass(t->run->robot) * EVAL_GRAVITY, error);
    }
    for (int i = 0; t->run->each && i < t->trials; i++) {
        t->run->each[i] = (EvalTrial){.end = t->end[i],
                                      .up = is_over(t, i) ? NAN : measure_up(&t->measure[i]),
                                      .seconds = t->measure[i].time,
                                      .legs = measure_legs(&t->measure[i]),
                                      .shells = measure_shells(&t->measure[i]),
                                      .torque = t->measure[i].torque_max,
                                      .x = t->measure[i].base[0]};
    }
    if (status == MILD_OK && eval.track) {
        track_print(&t->track, t->run->scenes[0].name, speed_of(t, 0), TASK_PERIOD, eval.track);
    }
    if (status == MILD_OK && eval.feet) {
        feet_print(&t->feet, t->run->scenes[0].name, speed_of(t, 0), t->task.physics_dt, eval.feet);
    }
    return status;
}

MildStatus eval_run(const EvalRun *run, EvalRow *rows, MildError *error) {
    MildStatus status = run->batch ? check_batch(run, error) : MILD_OK;
    if (status != MILD_OK) {
        return status;
    }
    Trials t = {.run = run, .task = *run->task, .rows = run->scene_count * run->speed_count};
    const int steps = (int)(run->eval.seconds / TASK_PERIOD + 0.5);
    t.trials = t.rows * run->eval.trials;
    t.task.episode = run->eval.seconds;
    status = open_envs(&t, error);
    status = status == MILD_OK ? take_limits(&t, error) : status;
    status = status == MILD_OK ? open_arrays(&t, error) : status;
    t.speed_hold = speed_hold_def(&t.task, run->robot, run->controller);
    if (status == MILD_OK && run->eval.track) {
        status = track_make(&t.track, t.trials, steps, error);
    }
    if (status == MILD_OK && run->eval.feet) {
        status = feet_make(&t.feet, run->robot, t.trials, steps * t.samples, error);
    }
    status = status == MILD_OK ? start(&t, error) : status;
    for (int k = 0; status == MILD_OK && k < steps; k++) {
        status = step(&t, k, error);
    }
    if (status == MILD_OK) {
        status = summarise(&t, rows, error);
    }
    close_trials(&t);
    return status;
}
