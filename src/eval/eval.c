#include "eval/eval.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define HEADING_GAIN 1.0  /* [1/s] */
#define HEADING_LIMIT 0.5 /* [rad/s] */

void eval_direct(const double q[4], double speed, double sideways, double command[3]) {
    double yaw = atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]));
    command[0] = speed;
    command[1] = sideways;
    command[2] = speed == 0 && sideways == 0
                     ? 0
                     : fmin(fmax(-HEADING_GAIN * yaw, -HEADING_LIMIT), HEADING_LIMIT);
}

void eval_command(TaskEnv *env, double speed, double sideways) {
    env->command_frozen = 1;
    eval_direct(env->robot.qpos + 3, speed, sideways, env->command);
}

typedef struct {
    const TaskDef *def;
    const Robot *robot;
    const Scene *scene;
    const EvalDef *eval;
    TaskEnv **env;    /* [trials] */
    RobotSim **sim;   /* [threads] */
    Measure *measure; /* [trials] */
    float *action;    /* [trials][robot_joints] */
    uint8_t *over;    /* [trials] fell or diverged */
} Trials;

static void start_trial(void *context, int trial, int thread) {
    Trials *t = context;
    TaskView none = {0};
    TaskEnv *env = t->env[trial];
    task_env_init(env, t->def, t->robot, t->eval->seed, (uint32_t)trial);
    eval_command(env, t->eval->speed, t->eval->sideways);
    task_env_reset_on(env, t->def, t->robot, t->sim[thread], &t->scene->terrain, t->scene->rigid,
                      &none);
    measure_start(&t->measure[trial], t->def->physics_dt);
    t->measure[trial].steady_end = t->eval->stop;
}

static void step_trial(void *context, int trial, int thread) {
    Trials *t = context;
    if (t->over[trial]) {
        return;
    }
    TaskView none = {0};
    TaskProbe probe = {measure_step, &t->measure[trial]};
    TaskStep step = task_env_step(t->env[trial], t->def, t->robot, t->sim[thread],
                                  t->action + trial * robot_joints(t->robot), 0, &none, &probe);
    t->over[trial] = step.done && !step.timeout;
    const EvalDef *eval = t->eval;
    int stopped = eval->stop > 0 && t->measure[trial].time >= eval->stop;
    eval_command(t->env[trial], stopped ? 0 : eval->speed, stopped ? 0 : eval->sideways);
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
    free(t->measure);
    free(t->action);
    free(t->over);
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
    Trials t = {.def = &local, .robot = robot, .scene = scene, .eval = eval};
    MildStatus status = make_trials(&t, eval->trials, pool_threads(pool), error);
    if (status == MILD_OK) {
        pool_run(pool, eval->trials, start_trial, &t);
        int steps = (int)(eval->seconds / TASK_PERIOD + 0.5);
        for (int step = 0; step < steps; step++) {
            controller->act(controller->self, eval->trials, t.env, t.action);
            pool_run(pool, eval->trials, step_trial, &t);
        }
        eval_summarise(row, scene->name, eval, t.measure, t.over,
                       robot_total_mass(robot) * EVAL_GRAVITY);
    }
    free_trials(&t, eval->trials, pool_threads(pool));
    return status;
}
