#include "env/actuator/fit.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/random.h"
#include "env/actuator/private.h"
#include "learn/optimiser.h"
#include "learn/product.h"

#define BLOCK_TIME 1.0     /* [s] that is trained on or held out together */
#define BLOCKS 5           /* of which one is held out */
#define LEARNING_RATE 2e-3 /* at the first step; it falls linearly to 0 */
#define RANDOM_USE_HELD 0x48454c44u
#define RANDOM_USE_BATCH 0x42415443u

enum { BATCH = 512, SAMPLES_MIN = 100 };

/* A joint at a row, whose history is rows `lag` apart. */
typedef struct {
    int row, joint, lag;
} Sample;

/* The work on one kind of motor. */
typedef struct {
    const ActuatorFitDef *def;
    const Record *record;
    Actuator *actuator;
    int kind;
    Sample *sample[2]; /* trained, held out */
    int count[2];
    ActuatorScore *score;
    int failed; /* bool: out of memory */
} Work;

ActuatorFitDef actuator_fit_default(void) {
    return (ActuatorFitDef){.spacing = 0.01, .steps = 6000, .seed = 1};
}

/* ---- samples ---- */

/* Bool: the block of a file is held out: one of each BLOCKS that follow each other. */
static int is_held(const ActuatorFitDef *def, int file, int block) {
    Random r = random_at(def->seed ^ RANDOM_USE_HELD, (uint32_t)file, (uint32_t)(block / BLOCKS));
    return block % BLOCKS == (int)random_index(&r, BLOCKS);
}

static int block_of(const Record *record, const RecordFile *file, int row) {
    return (int)((record->time[row] - record->time[file->first]) / BLOCK_TIME);
}

/* Bool: the history of a row has no gap and lies in its block. */
static int is_whole(const Record *record, const RecordFile *file, int row, int lag) {
    const int oldest = row - (ACTUATOR_TIMES - 1) * lag;
    const double span = record->time[row] - record->time[oldest < 0 ? 0 : oldest];
    return oldest >= file->first && block_of(record, file, oldest) == block_of(record, file, row) &&
           fabs(span - (row - oldest) * file->interval) < 0.5 * file->interval;
}

/* Rows of a file between the times of the history; -1 with a message when there are none. */
static int find_lag(const ActuatorFitDef *def, const RecordFile *file, MildError *error) {
    const double lag = def->spacing / file->interval;
    if (lag > 0.98 && lag < RECORD_ROWS_MAX && fabs(lag - round(lag)) < 0.02 * lag) {
        return (int)lround(lag);
    }
    mild_fail(
        error, MILD_ERROR_ARGUMENT,
        "the log has a row every %.4g s, of which the history's %.4g s are no whole multiple; "
        "choose --spacing, or resample the log",
        file->interval, def->spacing);
    return -1;
}

/* Visits the samples of a kind; with `out` not NULL writes them. Counts them in count[2]. */
static MildStatus list_samples(const Work *work, const int *kind, Sample *const *out, int *count,
                               MildError *error) {
    const Record *record = work->record;
    count[0] = count[1] = 0;
    for (int f = 0; f < record->files; f++) {
        const RecordFile *file = &record->file[f];
        const int lag = find_lag(work->def, file, error);
        if (lag < 0) {
            return error->status;
        }
        for (int row = file->first; row < file->first + file->rows; row++) {
            const int held = is_held(work->def, f, block_of(record, file, row));
            for (int i = 0; i < record->joints && is_whole(record, file, row, lag); i++) {
                if (kind[i] != work->kind || !file->logged[i]) {
                    continue;
                }
                if (out) {
                    out[held][count[held]] = (Sample){row, i, lag};
                }
                count[held]++;
            }
        }
    }
    return MILD_OK;
}

static MildStatus take_samples(Work *work, const int *kind, MildError *error) {
    MildStatus status = list_samples(work, kind, NULL, work->count, error);
    const char *name = robot_joint_name(work->record->robot, work->score->joint);
    if (status != MILD_OK) {
        return status;
    }
    if (work->count[0] < SAMPLES_MIN || work->count[1] < SAMPLES_MIN) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "%d samples to train on and %d held out of joints with a motor as %s's; "
                         "%d of each are needed: log such a joint, for 10 s or more without gaps",
                         work->count[0], work->count[1], name, SAMPLES_MIN);
    }
    for (int held = 0; held < 2; held++) {
        work->sample[held] = malloc((size_t)work->count[held] * sizeof(Sample));
        if (!work->sample[held]) {
            return mild_fail(error, MILD_ERROR_MEMORY, "actuator: out of memory");
        }
    }
    return list_samples(work, kind, work->sample, work->count, error);
}

/* Of a sample, `times` before its row. */
static const RecordJoint *at(const Record *record, Sample s, int times) {
    return &record
                ->joint[(size_t)(s.row - times * s.lag) * (size_t)record->joints + (size_t)s.joint];
}

/* ---- what it is compared with ---- */

typedef double Predict(const Work *work, Sample s);

static double predict_ideal(const Work *work, Sample s) {
    const Robot *robot = work->record->robot;
    const RecordJoint *now = at(work->record, s, 0);
    const double limit = robot_effort(robot)[s.joint];
    const double torque = robot_kp(robot)[s.joint] * (double)now->error -
                          robot_kd(robot)[s.joint] * (double)now->speed;
    return fmin(fmax(torque, -limit), limit);
}

static double predict_linear(const Work *work, Sample s) {
    const RecordJoint *now = at(work->record, s, 0);
    return work->score->kp * (double)now->error - work->score->kd * (double)now->speed;
}

static double predict_network(const Work *work, Sample s) {
    double error[ACTUATOR_TIMES], speed[ACTUATOR_TIMES];
    for (int t = 0; t < ACTUATOR_TIMES; t++) {
        error[t] = (double)at(work->record, s, t)->error;
        speed[t] = (double)at(work->record, s, t)->speed;
    }
    return actuator_torque(work->actuator, s.joint, error, speed);
}

/* Root mean square error on the held-out samples. */
static double held_error(const Work *work, Predict *predict) {
    double sum = 0;
    for (int i = 0; i < work->count[1]; i++) {
        const Sample s = work->sample[1][i];
        const double wrong = predict(work, s) - (double)at(work->record, s, 0)->torque;
        sum += wrong * wrong;
    }
    return sqrt(sum / work->count[1]);
}

/* Standard deviation of the held-out torques. */
static double held_deviation(const Work *work) {
    double sum = 0, squares = 0;
    for (int i = 0; i < work->count[1]; i++) {
        const double torque = (double)at(work->record, work->sample[1][i], 0)->torque;
        sum += torque;
        squares += torque * torque;
    }
    const double mean = sum / work->count[1];
    return sqrt(fmax(squares / work->count[1] - mean * mean, 0));
}

/* Least squares of torque = kp error - kd speed over the training samples. A speed that follows
 * the error everywhere, or is 0, leaves kd at 0. */
static void fit_linear(const Work *work, double *kp, double *kd) {
    double ee = 0, ev = 0, vv = 0, et = 0, vt = 0;
    for (int i = 0; i < work->count[0]; i++) {
        const RecordJoint *now = at(work->record, work->sample[0][i], 0);
        const double e = (double)now->error, v = (double)now->speed, t = (double)now->torque;
        ee += e * e, ev += e * v, vv += v * v;
        et += e * t, vt += v * t;
    }
    const double determinant = ee * vv - ev * ev;
    const int both = determinant > 1e-9 * ee * vv;
    *kp = both ? (et * vv - vt * ev) / determinant : ee > 0 ? et / ee : 0;
    *kd = both ? (et * ev - vt * ee) / determinant : 0;
}

/* ---- training ---- */

/* Arrays of one training, one block. */
typedef struct {
    float *block;
    float *parameters, *gradient, *first, *second; /* [parameters] */
    float *x;                                      /* [BATCH][ACTUATOR_INPUTS] */
    float *wanted;                                 /* [BATCH] torques */
    float *slope;                                  /* [BATCH] of the loss */
    float *work[2];
    MlpOutputs outputs;
} Training;

static int training_open(Training *t, const Mlp *mlp) {
    const size_t count = (size_t)actuator_parameters();
    for (int pass = 0; pass < 2; pass++) {
        size_t used = 0;
        float **arrays[] = {&t->parameters, &t->gradient, &t->first, &t->second};
        for (int a = 0; a < 4; a++) {
            *arrays[a] = mlp_carve(t->block, &used, count);
        }
        t->x = mlp_carve(t->block, &used, (size_t)BATCH * ACTUATOR_INPUTS);
        t->wanted = mlp_carve(t->block, &used, BATCH);
        t->slope = mlp_carve(t->block, &used, BATCH);
        for (int w = 0; w < 2; w++) {
            t->work[w] = mlp_carve(t->block, &used, (size_t)BATCH * (size_t)mlp_widest(mlp));
        }
        mlp_carve_outputs(mlp, BATCH, t->block, &used, &t->outputs);
        if (pass == 0) {
            t->block = aligned_alloc(64, used * sizeof(float));
            if (!t->block) {
                return 0;
            }
            memset(t->block, 0, used * sizeof(float));
        }
    }
    return 1;
}

/* Root mean squares of the training samples; 1 for what is 0 throughout. */
static ActuatorScale find_scale(const Work *work) {
    double sum[3] = {0};
    for (int i = 0; i < work->count[0]; i++) {
        const RecordJoint *now = at(work->record, work->sample[0][i], 0);
        sum[0] += (double)now->error * (double)now->error;
        sum[1] += (double)now->speed * (double)now->speed;
        sum[2] += (double)now->torque * (double)now->torque;
    }
    for (int n = 0; n < 3; n++) {
        sum[n] = sum[n] > 0 ? sqrt(sum[n] / work->count[0]) : 1;
    }
    return (ActuatorScale){sum[0], sum[1], sum[2]};
}

static void draw_batch(const Work *work, ActuatorScale scale, int step, Training *t) {
    Random r = random_at(work->def->seed ^ RANDOM_USE_BATCH, (uint32_t)work->kind, (uint32_t)step);
    for (int b = 0; b < BATCH; b++) {
        const Sample s = work->sample[0][random_index(&r, (uint32_t)work->count[0])];
        float *x = t->x + (ptrdiff_t)b * ACTUATOR_INPUTS;
        for (int k = 0; k < ACTUATOR_TIMES; k++) {
            const RecordJoint *then = at(work->record, s, k);
            x[k] = (float)((double)then->error / scale.error);
            x[ACTUATOR_TIMES + k] = (float)((double)then->speed / scale.speed);
        }
        t->wanted[b] = (float)((double)at(work->record, s, 0)->torque / scale.torque);
    }
}

/* Minimises the mean squared error by Adam. */
static void train(const Work *work, ActuatorScale scale, const Mlp *mlp, Training *t) {
    const MlpInputGradient none = {NULL, 0, 0};
    mlp_initialise(mlp, t->parameters, work->def->seed, (uint32_t)work->kind, 0.1);
    for (int step = 0; step < work->def->steps; step++) {
        const double rate = LEARNING_RATE * (1.0 - (double)step / work->def->steps);
        draw_batch(work, scale, step, t);
        const float *torque =
            mlp_forward(mlp, t->parameters, BATCH, t->x, ACTUATOR_INPUTS, &t->outputs);
        for (int b = 0; b < BATCH; b++) {
            t->slope[b] = 2.0f / BATCH * (torque[b] - t->wanted[b]);
        }
        mlp_backward(mlp, t->parameters, BATCH, t->x, ACTUATOR_INPUTS, &t->outputs, t->slope,
                     t->work, t->gradient, 0.0f, none);
        adam_apply(adam_step(rate, step + 1, 1), actuator_parameters(), t->gradient, t->parameters,
                   t->first, t->second);
    }
}

static void fit_kind(void *context, int piece, int thread) {
    Work *work = (Work *)context + piece;
    const Mlp mlp = actuator_mlp();
    Training training = {0};
    ActuatorScore *score = work->score;
    (void)thread;
    work->failed = !training_open(&training, &mlp);
    if (work->failed) {
        return;
    }
    const ActuatorScale scale = find_scale(work);
    const int entered = product_enter(0);
    train(work, scale, &mlp, &training);
    product_leave(entered);
    actuator_set(work->actuator, work->kind, scale, training.parameters);
    free(training.block);
    fit_linear(work, &score->kp, &score->kd);
    score->trained = work->count[0];
    score->held = work->count[1];
    score->deviation = held_deviation(work);
    score->ideal = held_error(work, predict_ideal);
    score->linear = held_error(work, predict_linear);
    score->network = held_error(work, predict_network);
}

/* Samples of all kinds, then their trainings side by side. */
static MildStatus fit_all(Work *work, int kinds, const int *kind, Pool *pool, MildError *error) {
    MildStatus status = MILD_OK;
    for (int k = 0; status == MILD_OK && k < kinds; k++) {
        status = take_samples(&work[k], kind, error);
    }
    if (status != MILD_OK) {
        return status;
    }
    pool_run(pool, kinds, fit_kind, work);
    for (int k = 0; k < kinds; k++) {
        if (work[k].failed) {
            return mild_fail(error, MILD_ERROR_MEMORY, "actuator: out of memory");
        }
        if (!isfinite(work[k].score->network)) {
            return mild_fail(error, MILD_ERROR_RANGE,
                             "actuator: the training for %s and joints like it diverged; look at "
                             "the units of the log",
                             robot_joint_name(work[k].record->robot, work[k].score->joint));
        }
    }
    return MILD_OK;
}

/* The held-out samples of the first joint of each kind, in the order of the rows. */
static void print_held(const Work *work, int kinds, FILE *csv) {
    const Record *record = work->record;
    fprintf(csv, "joint,time_s,measured_nm,network_nm,pd_fit_nm,pd_nm\n");
    for (int k = 0; k < kinds; k++) {
        const Work *own = &work[k];
        for (int i = 0; i < own->count[1]; i++) {
            const Sample s = own->sample[1][i];
            if (s.joint == own->score->joint) {
                fprintf(csv, "%s,%.9g,%.6g,%.6g,%.6g,%.6g\n",
                        robot_joint_name(record->robot, s.joint), record->time[s.row],
                        (double)at(record, s, 0)->torque, predict_network(own, s),
                        predict_linear(own, s), predict_ideal(own, s));
            }
        }
    }
}

/* The kinds' work, before their samples are listed. */
static void begin(const ActuatorFitDef *def, const Record *record, Actuator *actuator, int kinds,
                  const int *kind, ActuatorScore *score, Work *work) {
    for (int k = 0; k < kinds; k++) {
        work[k] = (Work){
            .def = def, .record = record, .actuator = actuator, .kind = k, .score = &score[k]};
        score[k] = (ActuatorScore){0};
        while (kind[score[k].joint] != k) {
            score[k].joint++;
        }
    }
}

Actuator *actuator_fit(const ActuatorFitDef *def, const Record *record, Pool *pool,
                       ActuatorScore *score, MildError *error) {
    int kind[ROBOT_JOINTS_MAX];
    const int kinds = actuator_kinds(record->robot, kind);
    Actuator *actuator = actuator_create(record->robot, def->spacing, error);
    if (!actuator) {
        return NULL;
    }
    Work *work = calloc((size_t)kinds, sizeof *work);
    if (!work) {
        mild_fail(error, MILD_ERROR_MEMORY, "actuator: out of memory");
        actuator_destroy(actuator);
        return NULL;
    }
    begin(def, record, actuator, kinds, kind, score, work);
    MildStatus status = fit_all(work, kinds, kind, pool, error);
    if (status == MILD_OK && def->held_out) {
        print_held(work, kinds, def->held_out);
    }
    for (int k = 0; k < kinds; k++) {
        free(work[k].sample[0]);
        free(work[k].sample[1]);
    }
    free(work);
    if (status != MILD_OK) {
        actuator_destroy(actuator);
        return NULL;
    }
    return actuator;
}
