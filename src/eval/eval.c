#include "eval/eval.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "eval/measure.h"

#define GRAVITY 9.81
#define HEADING_GAIN 1.0  /* [1/s] */
#define HEADING_LIMIT 0.5 /* [rad/s] */

void eval_command(TaskEnv *env, double speed, double sideways) {
    const double *q = env->robot.qpos + 3;
    double yaw = atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]));
    env->command_frozen = 1;
    env->command[0] = speed;
    env->command[1] = sideways;
    env->command[2] = speed == 0 && sideways == 0
                          ? 0
                          : fmin(fmax(-HEADING_GAIN * yaw, -HEADING_LIMIT), HEADING_LIMIT);
}

typedef struct {
    const TaskDef *def;
    const Robot *robot;
    const Scene *scene;
    const EvalDef *eval;
    TaskEnv **env;    /* [trials] */
    RobotSim **sim;   /* [threads] */
    Measure *measure; /* [trials] */
    float *action;    /* [trials][TASK_ACTIONS] */
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
                                  t->action + (size_t)trial * TASK_ACTIONS, 0, &none, &probe);
    t->over[trial] = step.done && !step.timeout;
    const EvalDef *eval = t->eval;
    int stopped = eval->stop > 0 && t->measure[trial].time >= eval->stop;
    eval_command(t->env[trial], stopped ? 0 : eval->speed, stopped ? 0 : eval->sideways);
}

/* Student's t for 95 %, two sided: table up to 10 trials, then 1.96 + 2.6 / (degrees of freedom),
 * within 0.5 %. */
static double student_95(int samples) {
    static const double table[] = {0, 0, 12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26};
    return samples < 2 ? 0 : samples <= 10 ? table[samples] : 1.96 + 2.6 / (samples - 1);
}

/* Speed, cost of transport and base motion over the steady part of the trials that stayed up; of
 * all when none did: a robot that dives forward and falls is not fast. */
static void summarise_motion(const Trials *t, EvalRow *row) {
    double weight = robot_total_mass(t->robot) * GRAVITY, v_sum = 0, v_square = 0;
    int steady = 0;
    for (int i = 0; i < t->eval->trials; i++) {
        const Measure *m = &t->measure[i];
        if (m->steady_time <= 0.5 || (row->success && t->over[i])) {
            continue;
        }
        double distance = m->end_x - m->start_x, v = distance / m->steady_time;
        double left = m->end_y - m->start_y;
        double way = t->eval->sideways != 0 ? hypot(distance, left) : fabs(distance);
        v_sum += v;
        v_square += v * v;
        row->velocity_sideways += left / m->steady_time;
        row->cot += m->work / (weight * fmax(way, 1e-3));
        row->base_oscillation += m->base_high - m->base_low;
        steady++;
    }
    if (!steady) {
        return;
    }
    row->velocity = v_sum / steady;
    double variance =
        fmax(v_square / steady - row->velocity * row->velocity, 0) * steady / fmax(steady - 1, 1);
    double half = student_95(steady) * sqrt(variance / steady);
    row->velocity_low = row->velocity - half;
    row->velocity_high = row->velocity + half;
    row->velocity_sideways /= steady;
    row->cot /= steady;
    row->base_oscillation /= steady;
}

static void summarise(const Trials *t, EvalRow *row) {
    int n = t->eval->trials, swings = 0, stances = 0;
    double apex = 0, deepest = 0, drift = 0;
    *row = (EvalRow){.speed = t->eval->speed, .sideways = t->eval->sideways, .trials = n};
    snprintf(row->ground, sizeof row->ground, "%s", t->scene->name);
    for (int i = 0; i < n; i++) {
        Measure *m = &t->measure[i];
        measure_finish(m);
        row->success += !t->over[i];
        row->energy += m->energy / n;
        row->seconds += m->time / n;
        row->torque_max += m->torque_max / n;
        apex += m->apex_sum;
        swings += m->swings;
        deepest += m->deepest_sum;
        drift += m->drift_sum;
        stances += m->stances;
    }
    summarise_motion(t, row);
    row->clearance = swings ? apex / swings : 0;
    row->penetration = stances ? deepest / stances : 0;
    row->drift = stances ? drift / stances : 0;
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
    t->action = calloc((size_t)trials * TASK_ACTIONS, sizeof *t->action);
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
        summarise(&t, row);
    }
    free_trials(&t, eval->trials, pool_threads(pool));
    return status;
}

void eval_print_header(char *text, int size) {
    snprintf(text, (size_t)size, "%-26s %5s %7s %14s %5s %7s %7s %7s %7s %7s", "ground", "m/s",
             "upright", "measured m/s", "COT", "Nm max", "clear", "sink", "drift", "J/s");
}

void eval_print_row(const EvalRow *row, char *text, int size) {
    char cot[16] = "-", sideways[48] = ""; /* standing has no cost of transport */
    if (row->speed != 0 || row->sideways != 0) {
        snprintf(cot, sizeof cot, "%.2f", row->cot);
    }
    if (row->sideways != 0) {
        snprintf(sideways, sizeof sideways, "  sideways %.3f of %.2f m/s", row->velocity_sideways,
                 row->sideways);
    }
    snprintf(text, (size_t)size,
             "%-26s %5.2f %4d/%-2d %6.3f +- %5.3f %5s %7.1f %4.0f mm %4.1f mm %4.1f mm %7.0f%s",
             row->ground, row->speed, row->success, row->trials, row->velocity,
             0.5 * (row->velocity_high - row->velocity_low), cot, row->torque_max,
             1e3 * row->clearance, 1e3 * row->penetration, 1e3 * row->drift,
             row->seconds > 0 ? row->energy / row->seconds : 0, sideways);
}
