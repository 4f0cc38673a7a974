#include "run/eval/eval.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "run/eval/actions.h"
#include "run/eval/track.h"

#define HEADING_GAIN 1.0  /* [1/s] */
#define HEADING_LIMIT 0.5 /* [rad/s] */
#define PUSH_INTERVAL 4.0 /* [s] */
#define RANDOM_USE_PUSH 0x45505553u
#define TWO_PI 6.283185307179586

static void hold_heading(const double quaternion[4], double speed, double sideways,
                         double command[3]) {
    const double turn = -HEADING_GAIN * measure_yaw(quaternion);
    command[0] = speed;
    command[1] = sideways;
    command[2] = speed == 0 && sideways == 0 ? 0 : fmin(fmax(turn, -HEADING_LIMIT), HEADING_LIMIT);
}

void eval_direct(const EvalDef *eval, double time, const double quaternion[4], double command[3]) {
    if (eval->stop > 0 && time >= eval->stop) {
        hold_heading(quaternion, 0, 0, command);
        return;
    }
    hold_heading(quaternion, eval->speed, eval->sideways, command);
    if (eval->turn != 0) {
        command[2] = eval->turn;
    }
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

typedef struct {
    const TaskDef *def;
    const Robot *robot;
    const Scene *scene;
    const EvalDef *eval;
    const Controller *controller;
    TaskEnv **env;    /* [trials] */
    RobotSim **sim;   /* [threads] */
    Measure *measure; /* [trials] */
    float *action;    /* [trials][robot_joints] */
    uint8_t *over;    /* [trials] fell or diverged */
    Track track;      /* if EvalDef.track is given */
} Trials;

static void start_trial(void *context, int trial, int thread) {
    static const double ahead[4] = {1, 0, 0, 0};
    Trials *t = context;
    TaskView none = {0};
    TaskEnv *env = t->env[trial];
    task_env_init(env, t->def, t->robot, t->eval->seed, (uint32_t)trial);
    env->command_frozen = 1;
    eval_direct(t->eval, 0, ahead, env->command);
    task_env_reset_on(env, t->def, t->robot, t->sim[thread], &t->scene->terrain, t->scene->rigid,
                      &none);
    measure_start(&t->measure[trial], t->def->physics_dt);
    t->measure[trial].steady_end = t->eval->stop;
    t->measure[trial].keep = t->eval->stances != NULL;
}

static void step_trial(void *context, int trial, int thread) {
    Trials *t = context;
    if (t->over[trial]) {
        return;
    }
    TaskView none = {0};
    ControllerRow row = {t->controller, trial};
    TaskDrive drive = {controller_row_torque, &row};
    TaskProbe probe = {measure_step, &t->measure[trial], t->controller->torque ? &drive : NULL};
    TaskStep step = task_env_step(t->env[trial], t->def, t->robot, t->sim[thread],
                                  t->action + trial * robot_joints(t->robot), 0, &none, &probe);
    t->over[trial] = step.done && !step.timeout;
    if (t->eval->track && !t->over[trial]) {
        track_take(&t->track, trial, t->sim[thread]);
    }
    TaskEnv *env = t->env[trial];
    eval_direct(t->eval, t->measure[trial].time, env->robot.qpos + 3, env->command);
    push_trial(env, t->eval->push);
}

static void call_watch(const Trials *t, int step) {
    const EvalWatch *watch = t->eval->watch;
    for (int i = 0; watch && i < t->eval->trials; i++) {
        if (!t->over[i]) {
            watch->decided(watch->context, t->scene, t->eval->speed, i, step * TASK_PERIOD,
                           t->env[i]);
        }
    }
}

static void print_actions(const Trials *t, int step) {
    for (int i = 0; t->eval->actions && i < t->eval->trials; i++) {
        const ActionsRow row = {.task = t->def,
                                .scene = t->scene,
                                .speed = t->eval->speed,
                                .trial = i,
                                .time = step * TASK_PERIOD,
                                .env = t->env[i],
                                .action = t->action + i * robot_joints(t->robot)};
        if (!t->over[i]) {
            actions_print_row(t->eval->actions, &row);
        }
    }
}

static void free_trials(Trials *t, int trials, int threads) {
    for (int i = 0; t->env && i < trials; i++) {
        free(t->env[i]);
    }
    for (int i = 0; t->sim && i < threads; i++) {
        robot_sim_destroy(t->sim[i]);
    }
    free(t->env);
    free(t->sim);
    measure_free(t->measure, trials);
    free(t->action);
    free(t->over);
    track_free(&t->track);
}

static MildStatus make_trials(Trials *t, int trials, int threads, MildError *error) {
    t->env = calloc((size_t)trials, sizeof *t->env);
    t->sim = calloc((size_t)threads, sizeof *t->sim);
    t->measure = calloc((size_t)trials, sizeof *t->measure);
    t->action = calloc((size_t)trials * (size_t)robot_joints(t->robot), sizeof *t->action);
    t->over = calloc((size_t)trials, 1);
    int good = t->env && t->sim && t->measure && t->action && t->over;
    for (int i = 0; good && i < trials; i++) {
        t->env[i] = aligned_alloc(64, task_env_bytes(t->def, t->robot));
        good = t->env[i] != NULL;
    }
    if (!good) {
        return mild_fail(error, MILD_ERROR_MEMORY, "evaluation: out of memory for %d trials",
                         trials);
    }
    for (int i = 0; i < threads; i++) {
        t->sim[i] = robot_sim_create(t->robot, t->def->physics_dt, error);
        if (!t->sim[i]) {
            return MILD_ERROR_MEMORY;
        }
    }
    return MILD_OK;
}

MildStatus eval_run(const TaskDef *def, const Robot *robot, Pool *pool, Controller *controller,
                    const Scene *scene, const EvalDef *eval, EvalRow *row, MildError *error) {
    TaskDef local = *def;
    local.episode = eval->seconds;
    Trials t = {
        .def = &local, .robot = robot, .scene = scene, .eval = eval, .controller = controller};
    MildStatus status = make_trials(&t, eval->trials, pool_threads(pool), error);
    const int steps = (int)(eval->seconds / TASK_PERIOD + 0.5);
    if (status == MILD_OK && eval->track) {
        status = track_make(&t.track, eval->trials, steps, error);
    }
    if (status == MILD_OK) {
        pool_run(pool, eval->trials, start_trial, &t);
        for (int step = 0; step < steps; step++) {
            controller->act(controller->self, eval->trials, t.env, t.action);
            call_watch(&t, step);
            print_actions(&t, step);
            pool_run(pool, eval->trials, step_trial, &t);
        }
        status = eval_summarise(row, scene->name, eval, t.measure, t.over,
                                robot_total_mass(robot) * EVAL_GRAVITY, error);
    }
    if (status == MILD_OK && eval->track) {
        track_print(&t.track, scene->name, eval->speed, TASK_PERIOD, eval->track);
    }
    free_trials(&t, eval->trials, pool_threads(pool));
    return status;
}
