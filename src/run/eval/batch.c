/* Trials of all rows as one set of environments. A policy step is one step of all, and one copy of
 * what the host needs of it: the samples of the measures, the histories, and who fell. */
#include "ground/batch/batch.h"

#include <stdlib.h>
#include <string.h>

#include "device/device.h"
#include "env/envs.h"
#include "env/task/ground.h"
#include "run/eval/eval.h"

/* What the device writes in a policy step, one block there and its copy here. */
typedef struct {
    EnvsSample *sample; /* [trials][samples] */
    float *history;     /* [trials][TaskShape.history] */
    float *reward;      /* [trials] */
    uint8_t *done, *timeout, *valid;
} Results;

typedef struct {
    const EvalBatch *def;
    TaskDef task;
    Envs *envs;
    int rows, trials; /* trials of all rows */
    int samples;      /* physics steps of a policy step */
    size_t bytes;     /* of the block */
    void *device_block, *block;
    float *device_action; /* [trials][joints] on the device */
    Results device, host;
    float *action;    /* [trials][joints] */
    double *command;  /* [trials][3] */
    Measure *measure; /* [trials] */
    uint8_t *over;    /* [trials] fell or diverged */
} Batch;

/* ---- creation ---- */

/* A ground that a row can be on. */
static MildStatus check_scene(const Scene *scene, MildError *error) {
    if (scene->terrain.material_count > 1) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--ground %s: the batch engine has no courses; give "
                         "--train.robots=mujoco, or single grounds",
                         scene->name);
    }
    return MILD_OK;
}

static MildStatus check(const EvalBatch *def, MildError *error) {
    const int rows = def->scene_count * def->speed_count;
    if (!def->controller->act_on) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--controller %s reads what the batch engine does not hand over; give "
                         "--train.robots=mujoco",
                         def->controller->name);
    }
    if (def->eval.trials > EVAL_ROBOTS_MAX / rows) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "--trials %d of %d rows are more than %d robots at once; ask for fewer, "
                         "or give --train.robots=mujoco",
                         def->eval.trials, rows, EVAL_ROBOTS_MAX);
    }
    MildStatus status = MILD_OK;
    for (int i = 0; status == MILD_OK && i < def->scene_count; i++) {
        status = check_scene(&def->scenes[i], error);
    }
    return status;
}

static TaskGround *make_grounds(const EvalBatch *def) {
    TaskGround *ground = calloc((size_t)def->scene_count, sizeof *ground);
    for (int i = 0; ground && i < def->scene_count; i++) {
        const Scene *scene = &def->scenes[i];
        ground[i].material = scene->rigid ? mild_material_default() : scene->terrain.materials[0];
        ground[i].depth = scene->rigid ? 0 : task_standing_depth(def->robot, &ground[i].material);
    }
    return ground;
}

static MildStatus open_envs(Batch *b, MildError *error) {
    const EvalBatch *def = b->def;
    TaskGround *ground = make_grounds(def);
    EnvsTrial *trial = calloc((size_t)b->trials, sizeof *trial);
    if (!ground || !trial) {
        free(ground);
        free(trial);
        return mild_fail(error, MILD_ERROR_MEMORY, "evaluation: out of memory for %d trials",
                         b->trials);
    }
    for (int i = 0; i < b->trials; i++) {
        const int scene = i / def->eval.trials / def->speed_count;
        trial[i] = (EnvsTrial){.stream = (uint32_t)(i % def->eval.trials),
                               .ground = scene,
                               .rigid = def->scenes[scene].rigid};
    }
    const TaskGrounds grounds = {def->scene_count, ground};
    const EnvsDef envs = {.task = &b->task,
                          .robot = def->robot,
                          .pool = def->pool,
                          .batch = 1,
                          .device = def->device,
                          .count = b->trials,
                          .seed = def->eval.seed,
                          .chosen = &grounds,
                          .trial = trial};
    b->envs = envs_create(&envs, error);
    free(ground);
    free(trial);
    return b->envs ? MILD_OK : error->status;
}

static Results carve(const Batch *b, void *block) {
    const size_t trials = (size_t)b->trials, history = (size_t)task_shape(b->def->robot).history;
    Results at;
    at.sample = block;
    at.history = (float *)(void *)(at.sample + trials * (size_t)b->samples);
    at.reward = at.history + trials * history;
    at.done = (uint8_t *)(at.reward + trials);
    at.timeout = at.done + trials;
    at.valid = at.timeout + trials;
    return at;
}

static MildStatus open_arrays(Batch *b, MildError *error) {
    const size_t trials = (size_t)b->trials, joints = (size_t)robot_joints(b->def->robot);
    const size_t history = (size_t)task_shape(b->def->robot).history;
    b->samples = envs_physics_steps(b->envs);
    b->bytes = trials * ((size_t)b->samples * sizeof(EnvsSample) + (history + 1) * sizeof(float) +
                         3 * sizeof(uint8_t));
    b->block = calloc(1, b->bytes);
    b->action = calloc(trials * joints, sizeof *b->action);
    b->command = calloc(trials, 3 * sizeof *b->command);
    b->measure = calloc(trials, sizeof *b->measure);
    b->over = calloc(trials, 1);
    if (!b->block || !b->action || !b->command || !b->measure || !b->over) {
        return mild_fail(error, MILD_ERROR_MEMORY, "evaluation: out of memory for %d trials",
                         b->trials);
    }
    b->device_block = device_alloc(b->def->device, b->bytes, error);
    if (b->device_block) {
        b->device_action = device_alloc(b->def->device, trials * joints * sizeof *b->action, error);
    }
    if (!b->device_action) {
        return MILD_ERROR_MEMORY;
    }
    b->device = carve(b, b->device_block);
    b->host = carve(b, b->block);
    return MILD_OK;
}

static void close_batch(Batch *b) {
    device_free(b->def->device, b->device_block);
    device_free(b->def->device, b->device_action);
    envs_destroy(b->envs);
    free(b->block);
    free(b->action);
    free(b->command);
    measure_free(b->measure, b->trials);
    free(b->over);
}

/* ---- trials ---- */

/* The command of a trial in its next policy step. */
static void direct(Batch *b, int trial, const double *quaternion) {
    EvalDef eval = b->def->eval;
    eval.speed = b->def->speeds[trial / eval.trials % b->def->speed_count];
    eval_direct(&eval, b->measure[trial].time, quaternion, b->command + 3 * (size_t)trial);
}

static void start_trial(void *context, int trial, int thread) {
    static const double level[4] = {1, 0, 0, 0};
    Batch *b = context;
    (void)thread;
    measure_start(&b->measure[trial], b->task.physics_dt);
    b->measure[trial].steady_end = b->def->eval.stop;
    b->measure[trial].keep = b->def->eval.stances != NULL;
    direct(b, trial, level);
}

/* quaternion: written, the orientation after the step. */
static void take_sample(Measure *measure, const EnvsSample *from, const TaskShape *shape,
                        double quaternion[4]) {
    double torque[ROBOT_JOINTS_MAX], speed[ROBOT_JOINTS_MAX];
    for (int i = 0; i < 4; i++) {
        quaternion[i] = (double)from->quaternion[i];
    }
    MeasureSample sample = {.torque = torque,
                            .joint_speed = speed,
                            .joints = shape->joints,
                            .feet = shape->feet,
                            .base = {(double)from->base[0], (double)from->base[1]},
                            .base_height = (double)from->above,
                            .yaw = measure_yaw(quaternion)};
    for (int i = 0; i < shape->joints; i++) {
        torque[i] = (double)from->torque[i];
        speed[i] = (double)from->speed[i];
    }
    for (int f = 0; f < shape->feet; f++) {
        sample.foot[f] = (MeasureFoot){
            .load = (double)from->foot[f].load,
            .center = {(double)from->foot[f].center[0], (double)from->foot[f].center[1]},
            .height = (double)from->foot[f].height,
            .depth = (double)from->foot[f].depth,
        };
    }
    measure_sample(measure, &sample);
}

/* Measures the policy step, and says where to go in the next one. */
static void take_trial(void *context, int trial, int thread) {
    Batch *b = context;
    (void)thread;
    if (b->over[trial]) {
        return;
    }
    const TaskShape shape = task_shape(b->def->robot);
    const EnvsSample *sample = b->host.sample + (size_t)trial * (size_t)b->samples;
    double quaternion[4] = {1, 0, 0, 0};
    for (int k = 0; k < b->samples && sample[k].valid; k++) {
        take_sample(&b->measure[trial], &sample[k], &shape, quaternion);
    }
    b->over[trial] = b->host.done[trial] && !b->host.timeout[trial];
    direct(b, trial, quaternion);
}

static MildStatus start(Batch *b, MildError *error) {
    const EnvsView first = {.history = b->device.history};
    pool_run(b->def->pool, b->trials, start_trial, b);
    MildStatus status = envs_set_samples(b->envs, b->device.sample, error);
    status = status == MILD_OK ? envs_set_commands(b->envs, b->command, error) : status;
    if (status == MILD_OK) {
        status = envs_reset(b->envs, &first, NULL, error);
    }
    return status == MILD_OK
               ? device_copy(b->def->device, b->block, b->device_block, b->bytes, error)
               : status;
}

static MildStatus step(Batch *b, MildError *error) {
    const EvalBatch *def = b->def;
    const size_t bytes = (size_t)b->trials * (size_t)robot_joints(def->robot) * sizeof *b->action;
    const Results *at = &b->device;
    const EnvsStep call = {.action = b->device_action,
                           .reward = at->reward,
                           .done = at->done,
                           .timeout = at->timeout,
                           .valid = at->valid,
                           .next = {.history = at->history}};
    def->controller->act_on(def->controller->self, b->trials, b->host.history, b->action);
    MildStatus status = device_copy(def->device, b->device_action, b->action, bytes, error);
    if (status == MILD_OK) {
        status = envs_step(b->envs, &call, NULL, error);
    }
    if (status == MILD_OK) {
        status = device_copy(def->device, b->block, b->device_block, b->bytes, error);
    }
    if (status == MILD_OK) {
        pool_run(def->pool, b->trials, take_trial, b);
        status = envs_set_commands(b->envs, b->command, error);
    }
    return status;
}

static MildStatus summarise(Batch *b, EvalRow *rows, MildError *error) {
    const EvalBatch *def = b->def;
    EvalDef eval = def->eval;
    MildStatus status = MILD_OK;
    for (int row = 0; row < b->rows && status == MILD_OK; row++) {
        const int first = row * eval.trials;
        eval.speed = def->speeds[row % def->speed_count];
        status = eval_summarise(&rows[row], def->scenes[row / def->speed_count].name, &eval,
                                b->measure + first, b->over + first,
                                robot_total_mass(def->robot) * EVAL_GRAVITY, error);
    }
    return status;
}

MildStatus eval_run_batch(const EvalBatch *def, EvalRow *rows, MildError *error) {
    MildStatus status = check(def, error);
    if (status != MILD_OK) {
        return status;
    }
    Batch b = {.def = def, .task = *def->task, .rows = def->scene_count * def->speed_count};
    b.trials = b.rows * def->eval.trials;
    b.task.episode = def->eval.seconds;
    status = open_envs(&b, error);
    status = status == MILD_OK ? open_arrays(&b, error) : status;
    status = status == MILD_OK ? start(&b, error) : status;
    const int steps = (int)(def->eval.seconds / TASK_PERIOD + 0.5);
    for (int t = 0; status == MILD_OK && t < steps; t++) {
        status = step(&b, error);
    }
    if (status == MILD_OK) {
        status = summarise(&b, rows, error);
    }
    close_batch(&b);
    return status;
}
