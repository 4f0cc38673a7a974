#include "know/know.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define HEADING_GAIN 1.0  /* [1/s] as in an evaluation */
#define HEADING_LIMIT 0.5 /* [rad/s] */
#define FOOT_LOAD 20.0    /* [N] from which a foot stands */

typedef struct {
    const WalksDef *def;
    TaskDef task;
    TaskShape shape;
    Envs *envs;
    MildTerrain *terrain; /* [count] */
    EnvsTrial *trial;     /* [count] */
    TaskEnv **env;        /* [count] */
    EnvsSample *sample;   /* [count][samples] */
    float *frame, *critic, *history, *action, *reward;
    uint8_t *done, *timeout, *valid, *over;
    double *command; /* [count][TASK_COMMANDS] */
    int samples, steps;
} Walks;

static double yaw_of(const double q[4]) {
    return atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]));
}

/* Puts the phase where a clock of the period would be. */
static void turn_clock(Walks *w, int i, double period) {
    TaskEnv *env = w->env[i];
    if (period > 0 && !task_is_standing(&w->task, env->command_seen)) {
        const double turned =
            TASK_PERIOD / period - TASK_PERIOD / task_gait_period(&w->task, env->command_seen);
        env->phase += turned + (env->phase + turned < 0);
        env->phase -= floor(env->phase);
    }
}

static void direct(Walks *w, int i, int step) {
    const WalkRoute *walk = &w->def->walk[i];
    const double *asked = walk->command[step * walk->commands / w->steps];
    double *command = w->command + TASK_COMMANDS * (size_t)i;
    memcpy(command, asked, 3 * sizeof *command);
    if (w->def->care) {
        const WalkCare care = w->def->care(w->def->context, i);
        const double speed = hypot(asked[0], asked[1]);
        const double share = fmin(1, care.speed / fmax(speed, 1e-9));
        command[0] *= share;
        command[1] *= share;
        turn_clock(w, i, care.period);
    }
    if (asked[2] == 0 && (asked[0] != 0 || asked[1] != 0)) {
        const double turn = -HEADING_GAIN * yaw_of(w->env[i]->robot.qpos + 3);
        command[2] = fmin(fmax(turn, -HEADING_LIMIT), HEADING_LIMIT);
    }
}

static void show(const Walks *w, int i, int step) {
    const EnvsSample *last = w->sample + ((size_t)i + 1) * (size_t)w->samples - 1;
    WalkStep now = {.walk = i,
                    .step = step,
                    .frame = w->frame + (size_t)i * (size_t)w->shape.observation,
                    .critic = w->critic + (size_t)i * (size_t)w->shape.critic,
                    .command = w->command + TASK_COMMANDS * (size_t)i,
                    .forward = w->env[i]->robot.qpos[0]};
    for (int s = 0; step > 0 && s < w->samples; s++) {
        const EnvsSample *sample = last - s;
        for (int joint = 0; joint < sample->joints; joint++) {
            now.work += fabs(sample->torque[joint] * sample->speed[joint]) * w->task.physics_dt;
        }
    }
    for (int f = 0; f < w->shape.feet; f++) {
        const EnvsFoot *foot = &last->foot[f];
        now.material[f] =
            step == 0 || foot->load < FOOT_LOAD
                ? -1
                : mild_terrain_material_at(&w->terrain[i], foot->center[0], foot->center[1]);
    }
    w->def->stepped(w->def->context, &now);
}

static MildStatus open_walks(Walks *w, MildError *error) {
    const WalksDef *def = w->def;
    const size_t count = (size_t)def->count;
    w->terrain = calloc(count, sizeof *w->terrain);
    w->trial = calloc(count, sizeof *w->trial);
    w->env = calloc(count, sizeof(TaskEnv *));
    w->frame = calloc(count * (size_t)w->shape.observation, sizeof(float));
    w->critic = calloc(count * (size_t)w->shape.critic, sizeof(float));
    w->history = calloc(count * (size_t)w->shape.history, sizeof(float));
    w->action = calloc(count * (size_t)w->shape.actions, sizeof(float));
    w->reward = calloc(count, sizeof(float));
    w->done = calloc(4 * count, 1);
    w->command = calloc(TASK_COMMANDS * count, sizeof(double));
    if (!w->terrain || !w->trial || !w->env || !w->frame || !w->critic || !w->history ||
        !w->action || !w->reward || !w->done || !w->command) {
        return mild_fail(error, MILD_ERROR_MEMORY, "out of memory for %d walks", def->count);
    }
    w->timeout = w->done + count, w->valid = w->timeout + count, w->over = w->valid + count;
    for (int i = 0; i < def->count; i++) {
        w->terrain[i] = def->walk[i].terrain;
        w->trial[i] = (EnvsTrial){
            .stream = def->first + (uint32_t)i, .ground = i, .rigid = def->walk[i].rigid};
    }
    w->task.episode = def->seconds + 1;
    const EnvsDef envs = {.task = &w->task,
                          .robot = def->robot,
                          .pool = def->pool,
                          .device = -1,
                          .count = def->count,
                          .seed = def->seed,
                          .trial = w->trial,
                          .terrain = w->terrain,
                          .terrains = def->count,
                          .drive = {def->controller->torque, def->controller->self}};
    w->envs = envs_create(&envs, error);
    if (!w->envs) {
        return error->status;
    }
    w->samples = envs_physics_steps(w->envs);
    w->sample = calloc(count * (size_t)w->samples, sizeof *w->sample);
    if (!w->sample) {
        return mild_fail(error, MILD_ERROR_MEMORY, "out of memory for %d walks", def->count);
    }
    for (int i = 0; i < def->count; i++) {
        w->env[i] = envs_env(w->envs, i);
    }
    envs_set_samples(w->envs, w->sample);
    return MILD_OK;
}

static void close_walks(Walks *w) {
    envs_destroy(w->envs);
    free(w->terrain);
    free(w->trial);
    free(w->env);
    free(w->sample);
    free(w->frame);
    free(w->critic);
    free(w->history);
    free(w->action);
    free(w->reward);
    free(w->done);
    free(w->command);
}

static EnvsView view_of(const Walks *w) {
    return (EnvsView){.history = w->history, .critic = w->critic, .frame = w->frame};
}

static MildStatus start(Walks *w, MildError *error) {
    const EnvsView first = view_of(w);
    for (int i = 0; i < w->def->count; i++) {
        memcpy(w->command + TASK_COMMANDS * (size_t)i, w->def->walk[i].command[0],
               3 * sizeof(double));
    }
    MildStatus status = envs_set_commands(w->envs, w->command, error);
    return status == MILD_OK ? envs_reset(w->envs, &first, NULL, error) : status;
}

static MildStatus step_all(Walks *w, int step, int *lasted, MildError *error) {
    const WalksDef *def = w->def;
    const EnvsStep call = {.action = w->action,
                           .reward = w->reward,
                           .done = w->done,
                           .timeout = w->timeout,
                           .valid = w->valid,
                           .next = view_of(w)};
    for (int i = 0; i < def->count; i++) {
        if (!w->over[i]) {
            show(w, i, step);
            lasted[i] = step + 1;
        }
    }
    def->controller->act(def->controller->self, def->count, w->env, w->action);
    MildStatus status = envs_step(w->envs, &call, NULL, error);
    for (int i = 0; i < def->count; i++) {
        w->over[i] |= w->done[i];
        direct(w, i, step + 1 < w->steps ? step + 1 : step);
    }
    return status == MILD_OK ? envs_set_commands(w->envs, w->command, error) : status;
}

MildStatus walks_run(const WalksDef *def, int *lasted, MildError *error) {
    Walks w = {.def = def,
               .task = *def->task,
               .shape = task_shape(def->task, def->robot),
               .steps = (int)(def->seconds / TASK_PERIOD + 0.5)};
    MildStatus status = open_walks(&w, error);
    status = status == MILD_OK ? start(&w, error) : status;
    for (int k = 0; status == MILD_OK && k < w.steps; k++) {
        status = step_all(&w, k, lasted, error);
    }
    close_walks(&w);
    return status;
}
