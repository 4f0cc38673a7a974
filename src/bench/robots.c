#include <stdlib.h>

#include "base/clock.h"
#include "base/paths.h"
#include "batch/batch.h"
#include "bench/bench.h"
#include "control/controller.h"
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

/* Who acts, and its copies on the host. */
typedef struct {
    Controller controller;
    float *history, *action;
} Walker;

/* The actions of the shipped policy. */
static MildStatus act(const Walker *walker, const Rows *rows, const ExperimentDef *def,
                      MildError *error) {
    const PolicyDef *p = &def->policy;
    const size_t size = (size_t)def->train.envs * sizeof(float);
    MildStatus status = batch_copy(rows->device, walker->history, rows->history,
                                   size * (size_t)(p->frames * p->observation), error);
    if (status == MILD_OK) {
        walker->controller.act_on(walker->controller.self, def->train.envs, walker->history,
                                  walker->action);
        status = batch_copy(rows->device, rows->action, walker->action, size * (size_t)p->actions,
                            error);
    }
    return status;
}

/* Seconds of `steps` policy steps, without the time of the walker, which may be NULL. */
static MildStatus time_steps(Crowd *crowd, const Rows *rows, const ExperimentDef *def,
                             const Walker *walker, int steps, double *seconds, MildError *error) {
    const VecView view = {rows->history, rows->critic, rows->estimate, rows->frame};
    const int envs = def->train.envs, device = rows->device;
    double start = clock_seconds();
    MildStatus status = MILD_OK;
    *seconds = 0;
    for (int t = 0; t < steps && status == MILD_OK; t++) {
        if (walker) {
            status = act(walker, rows, def, error);
            start = clock_seconds();
        }
        if (status == MILD_OK) {
            status = crowd_step(crowd, rows->action, rows->reward, rows->flags, rows->flags + envs,
                                rows->flags + 2 * envs, &view, NULL, error);
        }
        if (status == MILD_OK && device != MILD_BATCH_HOST && (walker || t == steps - 1)) {
            status = device_wait(device, error);
        }
        if (walker || t == steps - 1) {
            *seconds += clock_seconds() - start;
        }
    }
    return status;
}

static MildStatus measure(Crowd *crowd, const Rows *rows, const ExperimentDef *def,
                          const Walker *walker, double *rate, VecStats *stats, MildError *error) {
    const VecView view = {rows->history, rows->critic, rows->estimate, rows->frame};
    const int device = rows->device != MILD_BATCH_HOST;
    const int steps = device ? 200 : 20;
    double seconds = 0;
    MildStatus status = crowd_reset(crowd, &view, NULL, error);
    if (status == MILD_OK) {
        status = time_steps(crowd, rows, def, walker, device ? WARM_STEPS : 0, &seconds, error);
    }
    if (status == MILD_OK) {
        status = time_steps(crowd, rows, def, walker, steps, &seconds, error);
    }
    if (status == MILD_OK) {
        status = crowd_take_sums(crowd, stats, NULL, error);
    }
    *rate = (double)def->train.envs * steps / seconds;
    return status;
}

static MildStatus march(Crowd *crowd, const ExperimentDef *def, const Rows *rows,
                        BenchReport *report, MildError *error) {
    double rate = 0;
    VecStats stats;
    MildStatus status = measure(crowd, rows, def, NULL, &rate, &stats, error);
    if (status == MILD_OK) {
        const CrowdMemory memory = crowd_memory(crowd);
        bench_add(report, "robots", "envs", def->train.envs, "-");
        bench_add(report, "robots", "policy_steps_per_s", rate, "1/s");
        bench_add(report, "robots", "episodes_ended", stats.episodes, "-");
        bench_add(report, "robots", "diverged", stats.diverged, "-");
        bench_add(report, "robots", "memory_per_robot", (double)crowd_robot_bytes(crowd), "B");
        bench_add(report, "robots", "memory_task", (double)memory.task, "B");
        bench_add(report, "robots", "memory_engine", (double)memory.engine, "B");
        bench_add(report, "robots", "memory_ground", (double)memory.ground, "B");
        bench_add(report, "robots", "memory_rest", (double)memory.rest, "B");
    }
    return status;
}

static MildStatus walk(Crowd *crowd, const ExperimentDef *def, const Rows *rows,
                       const Controller *controller, BenchReport *report, MildError *error) {
    const PolicyDef *p = &def->policy;
    const size_t envs = (size_t)def->train.envs;
    Walker walker = {*controller,
                     calloc(envs * (size_t)(p->frames * p->observation), sizeof(float)),
                     calloc(envs * (size_t)p->actions, sizeof(float))};
    double rate = 0;
    VecStats stats;
    MildStatus status = walker.history && walker.action
                            ? measure(crowd, rows, def, &walker, &rate, &stats, error)
                            : mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
    if (status == MILD_OK) {
        bench_add(report, "robots", "walking_policy_steps_per_s", rate, "1/s");
        bench_add(report, "robots", "walking_episodes_ended", stats.episodes, "-");
    }
    free(walker.history);
    free(walker.action);
    return status;
}

/* A crowd and its rows, for march, or for walk when there is a controller. */
static MildStatus with_crowd(const ExperimentDef *def, const Robot *robot, Pool *pool,
                             const Controller *controller, BenchReport *report, MildError *error) {
    const int device = train_device(&def->train);
    Rows rows = {.device = device < 0 ? MILD_BATCH_HOST : device};
    const CrowdDef of = {.task = &def->task,
                         .robot = robot,
                         .pool = pool,
                         .device = rows.device,
                         .envs = def->train.envs,
                         .grounds = 4096,
                         .seed = def->train.seed};
    Crowd *crowd = crowd_create(&of, error);
    MildStatus status = crowd ? rows_open(&rows, def, rows.device, error) : error->status;
    if (status == MILD_OK) {
        status = controller ? walk(crowd, def, &rows, controller, report, error)
                            : march(crowd, def, &rows, report, error);
    }
    rows_close(&rows);
    crowd_destroy(crowd);
    return status;
}

MildStatus bench_robots(const ExperimentDef *def, BenchReport *report, MildError *error) {
    ExperimentDef local = *def;
    local.task.randomize.patch_share = 0;
    char path[PATH_SIZE];
    Controller controller;
    MildError unused;
    Robot *robot = robot_open(def->train.robot, error);
    Pool *pool = robot ? pool_create(def->train.threads) : NULL;
    MildStatus status = robot ? MILD_OK : error->status;
    if (robot && !pool) {
        status = mild_fail(error, MILD_ERROR_MEMORY, "cannot start threads");
    }
    if (status == MILD_OK) {
        experiment_fit_robot(&local, robot);
        robot_set_model(robot, (MildModel)local.task.randomize.model);
        status = with_crowd(&local, robot, pool, NULL, report, error);
    }
    /* a robot that the shipped policy does not know only marches */
    if (status == MILD_OK &&
        controller_learned(path_data("policies/mild.safetensors", path), robot, pool,
                           local.train.envs, &controller, &unused) == MILD_OK) {
        local.task.assist = 0;
        status = with_crowd(&local, robot, pool, &controller, report, error);
        controller_destroy(&controller);
    }
    pool_destroy(pool);
    robot_destroy(robot);
    return status;
}
