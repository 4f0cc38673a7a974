#include <stdlib.h>

#include "base/clock.h"
#include "batch/batch.h"
#include "bench/bench.h"
#include "crowd/crowd.h"

enum { WARM_STEPS = 100 };

/* Rows of the environments, in the memory of the device. */
typedef struct {
    int device;
    float *history, *critic, *estimate, *frame, *action, *reward;
    uint8_t *flags; /* [3][envs] */
} Rows;

static MildStatus rows_open(Rows *rows, const ExperimentDef *def, int device, MildError *error) {
    const size_t envs = (size_t)def->train.envs;
    const PolicyDef *p = &def->policy;
    struct {
        float **at;
        int width;
    } all[] = {{&rows->history, p->frames * p->observation},
               {&rows->critic, p->critic_input},
               {&rows->estimate, p->estimates},
               {&rows->frame, p->observation},
               {&rows->action, p->actions},
               {&rows->reward, 1}};
    rows->device = device;
    int good = 1;
    for (size_t i = 0; good && i < sizeof all / sizeof *all; i++) {
        *all[i].at = batch_alloc(device, envs * (size_t)all[i].width * sizeof(float), error);
        good = *all[i].at != NULL;
    }
    rows->flags = good ? batch_alloc(device, 3 * envs, error) : NULL;
    return rows->flags ? MILD_OK : MILD_ERROR_MEMORY;
}

static void rows_close(Rows *rows) {
    void *const all[] = {rows->history, rows->critic, rows->estimate, rows->frame,
                         rows->action,  rows->reward, rows->flags};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        batch_free(rows->device, all[i]);
    }
}

/* Seconds of `steps` policy steps. */
static MildStatus time_steps(Crowd *crowd, const Rows *rows, int envs, int steps, double *seconds,
                             MildError *error) {
    const VecView view = {rows->history, rows->critic, rows->estimate, rows->frame};
    const double start = clock_seconds();
    MildStatus status = MILD_OK;
    for (int t = 0; t < steps && status == MILD_OK; t++) {
        status = crowd_step(crowd, rows->action, rows->reward, rows->flags, rows->flags + envs,
                            rows->flags + 2 * envs, &view, NULL, error);
    }
    if (status == MILD_OK && rows->device != MILD_BATCH_HOST) {
        status = device_wait(rows->device, error);
    }
    *seconds = clock_seconds() - start;
    return status;
}

static MildStatus run(Crowd *crowd, const ExperimentDef *def, Rows *rows, BenchReport *report,
                      MildError *error) {
    const VecView view = {rows->history, rows->critic, rows->estimate, rows->frame};
    const int envs = def->train.envs, device = rows->device != MILD_BATCH_HOST;
    const int steps = device ? 200 : 20;
    double seconds = 0;
    VecStats stats;
    MildStatus status = crowd_reset(crowd, &view, NULL, error);
    if (status == MILD_OK) {
        status = time_steps(crowd, rows, envs, device ? WARM_STEPS : 0, &seconds, error);
    }
    if (status == MILD_OK) {
        status = time_steps(crowd, rows, envs, steps, &seconds, error);
    }
    if (status == MILD_OK) {
        status = crowd_take_sums(crowd, &stats, NULL, error);
    }
    if (status == MILD_OK) {
        bench_add(report, "robots", "envs", envs, "-");
        bench_add(report, "robots", "policy_steps_per_s", (double)envs * steps / seconds, "1/s");
        bench_add(report, "robots", "episodes_ended", stats.episodes, "-");
        bench_add(report, "robots", "diverged", stats.diverged, "-");
        const CrowdMemory memory = crowd_memory(crowd);
        bench_add(report, "robots", "memory_per_robot", (double)crowd_robot_bytes(crowd), "B");
        bench_add(report, "robots", "memory_task", (double)memory.task, "B");
        bench_add(report, "robots", "memory_engine", (double)memory.engine, "B");
        bench_add(report, "robots", "memory_ground", (double)memory.ground, "B");
        bench_add(report, "robots", "memory_rest", (double)memory.rest, "B");
    }
    return status;
}

MildStatus bench_robots(const ExperimentDef *def, BenchReport *report, MildError *error) {
    ExperimentDef local = *def;
    local.task.randomize.patch_share = 0;
    Rows rows = {.device = MILD_BATCH_HOST};
    MildStatus status = MILD_OK;
    Robot *robot = robot_open(def->train.robot, error);
    Pool *pool = robot ? pool_create(def->train.threads) : NULL;
    Crowd *crowd = NULL;
    if (pool) {
        experiment_fit_robot(&local, robot);
        robot_set_model(robot, (MildModel)local.task.randomize.model);
        const CrowdDef of = {.task = &local.task,
                             .robot = robot,
                             .pool = pool,
                             .device = def->train.device[0] == 'c' && def->train.device[1] == 'u'
                                           ? 0
                                           : MILD_BATCH_HOST,
                             .envs = local.train.envs,
                             .grounds = 4096,
                             .seed = local.train.seed};
        crowd = crowd_create(&of, error);
        status = crowd ? rows_open(&rows, &local, of.device, error) : error->status;
        status = status == MILD_OK ? run(crowd, &local, &rows, report, error) : status;
    } else {
        status =
            robot ? mild_fail(error, MILD_ERROR_MEMORY, "cannot start threads") : error->status;
    }
    rows_close(&rows);
    crowd_destroy(crowd);
    pool_destroy(pool);
    robot_destroy(robot);
    return status;
}
