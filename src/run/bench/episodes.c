/* Whether the batch engine's environments are those of MuJoCo: the shipped policy's returns in
 * whole episodes of both, with the same random numbers. */
#include <math.h>
#include <stdlib.h>

#include "control/controller.h"
#include "device/device.h"
#include "ground/batch/batch.h"
#include "run/bench/bench.h"
#include "run/bench/record.h"
#include "run/train/envs.h"

enum { DEVICE_EPISODES = 1000, HOST_EPISODES = 40 };

/* One kind of environments. */
typedef struct {
    int device, count;
    ExperimentDef def;
    TrainEnvs envs;
    EnvsStep call;                    /* its arrays on the device */
    float *device_action;             /* that of call */
    float *history, *action, *reward; /* copies on the host */
    uint8_t *done, *timeout;
    double *returns; /* [count] of each environment's first episode */
    int *steps;      /* [count] of it; below 0 while it lasts */
    int falls;
} Side;

static MildStatus open_arrays(Side *side, const PolicyDef *p, MildError *error) {
    const size_t n = (size_t)side->count;
    EnvsStep *call = &side->call;
    struct {
        float **at;
        int width;
    } floats[] = {{&call->next.history, p->frames * p->observation},
                  {&call->next.critic, p->critic_input},
                  {&call->next.estimate, p->estimates},
                  {&call->next.frame, p->observation},
                  {&side->device_action, p->actions},
                  {&call->reward, 1}};
    uint8_t **bytes[] = {&call->done, &call->timeout, &call->valid};
    MildStatus status = MILD_OK;
    for (size_t i = 0; i < sizeof floats / sizeof *floats; i++) {
        const size_t size = n * (size_t)floats[i].width * sizeof(float);
        *floats[i].at = status == MILD_OK ? device_alloc(side->device, size, error) : NULL;
        status = *floats[i].at ? MILD_OK : error->status;
    }
    for (int i = 0; i < 3; i++) {
        *bytes[i] = status == MILD_OK ? device_alloc(side->device, n, error) : NULL;
        status = *bytes[i] ? MILD_OK : error->status;
    }
    call->action = side->device_action;
    side->history = calloc(n * (size_t)(p->frames * p->observation), sizeof *side->history);
    side->action = calloc(n * (size_t)p->actions, sizeof *side->action);
    side->reward = calloc(n, sizeof *side->reward);
    side->done = calloc(n, 2);
    side->timeout = side->done ? side->done + n : NULL;
    side->returns = calloc(n, sizeof *side->returns);
    side->steps = calloc(n, sizeof *side->steps);
    if (status == MILD_OK && (!side->history || !side->action || !side->reward || !side->done ||
                              !side->returns || !side->steps)) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
    }
    return status;
}

static void close_side(Side *side) {
    const EnvsStep *call = &side->call;
    void *const there[] = {call->next.history, call->next.critic,   call->next.estimate,
                           call->next.frame,   side->device_action, call->reward,
                           call->done,         call->timeout,       call->valid};
    void *const here[] = {side->history, side->action,  side->reward,
                          side->done,    side->returns, side->steps};
    for (size_t i = 0; i < sizeof there / sizeof *there; i++) {
        device_free(side->device, there[i]);
    }
    for (size_t i = 0; i < sizeof here / sizeof *here; i++) {
        free(here[i]);
    }
    train_envs_close(&side->envs);
}

/* Adds a step's rewards. Returns the episodes that still last. */
static int take_step(Side *side) {
    int lasting = 0;
    for (int i = 0; i < side->count; i++) {
        if (side->steps[i] < 0) {
            continue;
        }
        side->returns[i] += (double)side->reward[i];
        side->steps[i]++;
        if (side->done[i]) {
            side->falls += !side->timeout[i];
            side->steps[i] = -side->steps[i];
        }
        lasting += side->steps[i] > 0;
    }
    return lasting;
}

/* A policy step of all; *lasting as take_step. */
static MildStatus step(Side *side, const Controller *controller, const PolicyDef *p, int *lasting,
                       MildError *error) {
    const size_t n = (size_t)side->count, size = sizeof(float);
    const size_t history = n * (size_t)(p->frames * p->observation);
    const struct {
        void *to;
        const void *from;
        size_t bytes;
    } back[] = {{side->reward, side->call.reward, n * size},
                {side->done, side->call.done, n},
                {side->timeout, side->call.timeout, n}};
    MildStatus status =
        device_copy(side->device, side->history, side->call.next.history, history * size, error);
    if (status == MILD_OK) {
        controller->act_on(controller->self, side->count, side->history, side->action);
        status = device_copy(side->device, side->device_action, side->action,
                             n * (size_t)p->actions * size, error);
    }
    if (status == MILD_OK) {
        status = envs_step(side->envs.envs, &side->call, NULL, error);
    }
    for (int i = 0; i < 3 && status == MILD_OK; i++) {
        status = device_copy(side->device, back[i].to, back[i].from, back[i].bytes, error);
    }
    *lasting = take_step(side);
    return status;
}

static MildStatus run(Side *side, const ExperimentDef *def, const Robot *robot, Pool *pool,
                      const Controller *controller, MildError *error) {
    side->def = *def;
    MildStatus status =
        train_envs_open(&side->envs, &side->def, robot, pool, side->count, 0, error);
    status = status == MILD_OK ? open_arrays(side, &def->policy, error) : status;
    if (status == MILD_OK) {
        status = envs_reset(side->envs.envs, &side->call.next, NULL, error);
    }
    for (int lasting = 1; status == MILD_OK && lasting;) {
        status = step(side, controller, &def->policy, &lasting, error);
    }
    return status;
}

static int rising(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* sqrt(n/2) times the largest distance between the two samples' distribution functions, both
 * sorted: below 1.36 in 95 % of the cases if they have one distribution (Kolmogorov, Smirnov). */
static double distance(const Side *a, const Side *b) {
    const int n = a->count;
    double largest = 0;
    for (int i = 0, j = 0; i < n && j < n;) {
        const double x = a->returns[i] < b->returns[j] ? a->returns[i] : b->returns[j];
        for (; i < n && a->returns[i] <= x; i++) {
        }
        for (; j < n && b->returns[j] <= x; j++) {
        }
        largest = fmax(largest, fabs((double)(i - j)) / n);
    }
    return largest * sqrt(n / 2.0);
}

static void report_side(BenchReport *report, const char *names[4], Side *side) {
    double sum = 0;
    qsort(side->returns, (size_t)side->count, sizeof *side->returns, rising);
    for (int i = 0; i < side->count; i++) {
        sum += side->returns[i];
    }
    bench_add(report, "episodes", names[0], sum / side->count, "-");
    bench_add(report, "episodes", names[1], side->returns[side->count / 10], "-");
    bench_add(report, "episodes", names[2], side->returns[side->count / 2], "-");
    bench_add(report, "episodes", names[3], side->falls, "-");
}

static MildStatus compare(const ExperimentDef *def, const Robot *robot, Pool *pool,
                          const Controller *controller, BenchReport *report, MildError *error) {
    static const char *names[2][4] = {
        {"mujoco_return_mean", "mujoco_return_tenth", "mujoco_return_median", "mujoco_falls"},
        {"batch_return_mean", "batch_return_tenth", "batch_return_median", "batch_falls"}};
    ExperimentDef mujoco = *def, batch = *def;
    const int device = train_device(&def->train) < 0 ? MILD_BATCH_HOST : train_device(&def->train);
    const int count = device == MILD_BATCH_HOST ? HOST_EPISODES : DEVICE_EPISODES;
    Side a = {.device = MILD_BATCH_HOST, .count = count}, b = {.device = device, .count = count};
    mujoco.train.robots = TRAIN_ROBOTS_MUJOCO;
    batch.train.robots = TRAIN_ROBOTS_BATCH;
    MildStatus status = run(&a, &mujoco, robot, pool, controller, error);
    if (status == MILD_OK) {
        status = run(&b, &batch, robot, pool, controller, error);
    }
    if (status == MILD_OK) {
        bench_add(report, "episodes", "episodes", count, "-");
        report_side(report, names[0], &a);
        report_side(report, names[1], &b);
        bench_add(report, "episodes", "distance", distance(&a, &b), "-");
    }
    close_side(&a);
    close_side(&b);
    return status;
}

MildStatus bench_episodes(const ExperimentDef *def, BenchReport *report, MildError *error) {
    BenchContext c;
    Controller controller = {0};
    MildStatus status = bench_open(&c, def, error);
    if (status == MILD_OK) {
        c.def.task.assist = 0;
        status = bench_walker(c.robot, c.pool, DEVICE_EPISODES, &c.def.task, &controller, error);
    }
    if (status == MILD_OK) {
        status = compare(&c.def, c.robot, c.pool, &controller, report, error);
        controller_destroy(&controller);
    }
    bench_close(&c);
    return status;
}
