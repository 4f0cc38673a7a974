#include <stdlib.h>

#include "base/clock.h"
#include "bench/bench.h"
#include "bench/record.h"
#include "control/controller.h"
#include "device/device.h"
#include "env/envs.h"
#include "ground/batch/batch.h"

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
    } all[] = {{&rows->history, policy_history(p)}, {&rows->critic, p->critic_input},
               {&rows->estimate, p->estimates},     {&rows->frame, p->observation},
               {&rows->action, p->actions},         {&rows->reward, 1}};
    rows->device = device;
    int good = 1;
    for (size_t i = 0; good && i < sizeof all / sizeof *all; i++) {
        *all[i].at = device_alloc(device, envs * (size_t)all[i].width * sizeof(float), error);
        good = *all[i].at != NULL;
    }
    rows->flags = good ? device_alloc(device, 3 * envs, error) : NULL;
    return rows->flags ? MILD_OK : MILD_ERROR_MEMORY;
}

static void rows_close(Rows *rows) {
    void *const all[] = {rows->history, rows->critic, rows->estimate, rows->frame,
                         rows->action,  rows->reward, rows->flags};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        device_free(rows->device, all[i]);
    }
}

/* [steps] Warm ones and those that are timed. */
static int warm_steps(const Rows *rows) {
    return rows->device == MILD_BATCH_HOST ? 0 : 100;
}

static int timed_steps(const Rows *rows) {
    return rows->device == MILD_BATCH_HOST ? 20 : 200;
}

static EnvsView view_of(const Rows *rows) {
    return (EnvsView){rows->history, rows->critic, rows->estimate, rows->frame};
}

/* One policy step. script: the actions of every step, [steps][envs][actions]; NULL: nobody acts. */
static MildStatus step(Envs *envs, const Rows *rows, const ExperimentDef *def, const float *script,
                       int t, MildError *error) {
    const size_t count = (size_t)def->train.envs;
    const EnvsStep call = {
        .action = script ? script + (size_t)t * count * (size_t)def->policy.actions : rows->action,
        .reward = rows->reward,
        .done = rows->flags,
        .timeout = rows->flags + count,
        .valid = rows->flags + 2 * count,
        .next = view_of(rows)};
    return envs_step(envs, &call, NULL, error);
}

/* From the first episodes on: seconds of the timed steps, between which the host does not wait. */
static MildStatus time_steps(Envs *envs, const Rows *rows, const ExperimentDef *def,
                             const float *script, double *seconds, MildError *error) {
    const EnvsView view = view_of(rows);
    const int warm = warm_steps(rows), all = warm + timed_steps(rows);
    MildStatus status = envs_reset(envs, &view, NULL, error);
    double start = clock_seconds();
    for (int t = 0; t < all && status == MILD_OK; t++) {
        status = step(envs, rows, def, script, t, error);
        if (rows->device != MILD_BATCH_HOST && status == MILD_OK &&
            (t == warm - 1 || t == all - 1)) {
            status = device_wait(rows->device, error);
        }
        start = t == warm - 1 ? clock_seconds() : start;
    }
    *seconds = clock_seconds() - start;
    return status;
}

static MildStatus measure(Envs *envs, const Rows *rows, const ExperimentDef *def,
                          const float *script, double *rate, EnvsStats *stats, MildError *error) {
    double seconds = 0;
    MildStatus status = time_steps(envs, rows, def, script, &seconds, error);
    *rate = (double)def->train.envs * timed_steps(rows) / seconds;
    return status == MILD_OK ? envs_sums(envs, stats, NULL, error) : status;
}

static MildStatus march(Envs *envs, const ExperimentDef *def, const Rows *rows, BenchReport *report,
                        MildError *error) {
    double rate = 0;
    EnvsStats stats;
    MildStatus status = measure(envs, rows, def, NULL, &rate, &stats, error);
    if (status == MILD_OK) {
        const EnvsMemory memory = envs_memory(envs);
        bench_add(report, "robots", "envs", def->train.envs, "-");
        bench_add(report, "robots", "policy_steps_per_s", rate, "1/s");
        bench_add(report, "robots", "episodes_ended", stats.episodes, "-");
        bench_add(report, "robots", "diverged", stats.diverged, "-");
        bench_add(report, "robots", "memory_per_robot", (double)envs_robot_bytes(envs), "B");
        bench_add(report, "robots", "memory_task", (double)memory.task, "B");
        bench_add(report, "robots", "memory_engine", (double)memory.engine, "B");
        bench_add(report, "robots", "memory_ground", (double)memory.ground, "B");
        bench_add(report, "robots", "memory_rest", (double)memory.rest, "B");
    }
    return status;
}

/* ---- a walk: its actions are written down, and walked again by the clock ---- */

/* Room on the host for what the policy sees and does. */
typedef struct {
    float *history, *action;
} Walker;

/* Writes the actions of the policy to the script. */
static MildStatus write_script(Envs *envs, const Rows *rows, const ExperimentDef *def,
                               const Controller *controller, const Walker *walker, float *script,
                               MildError *error) {
    const EnvsView view = view_of(rows);
    const PolicyDef *p = &def->policy;
    const size_t count = (size_t)def->train.envs, actions = count * (size_t)p->actions;
    MildStatus status = envs_reset(envs, &view, NULL, error);
    for (int t = 0; t < warm_steps(rows) + timed_steps(rows) && status == MILD_OK; t++) {
        status = device_copy(rows->device, walker->history, rows->history,
                             count * (size_t)policy_history(p) * sizeof(float), error);
        if (status == MILD_OK) {
            controller->act_on(controller->self, def->train.envs, walker->history, walker->action);
            status = device_copy(rows->device, script + (size_t)t * actions, walker->action,
                                 actions * sizeof(float), error);
        }
        status = status == MILD_OK ? step(envs, rows, def, script, t, error) : status;
    }
    return status;
}

static MildStatus record(Envs *envs, const ExperimentDef *def, const Rows *rows,
                         const Controller *controller, float *script, EnvsStats *stats,
                         MildError *error) {
    const PolicyDef *p = &def->policy;
    const size_t count = (size_t)def->train.envs;
    const Walker walker = {calloc(count * (size_t)policy_history(p), sizeof(float)),
                           calloc(count * (size_t)p->actions, sizeof(float))};
    MildStatus status = walker.history && walker.action
                            ? write_script(envs, rows, def, controller, &walker, script, error)
                            : mild_fail(error, MILD_ERROR_MEMORY, "bench: out of memory");
    free(walker.history);
    free(walker.action);
    return status == MILD_OK ? envs_sums(envs, stats, NULL, error) : status;
}

static MildStatus walk(Envs *envs, const ExperimentDef *def, const Rows *rows, const float *script,
                       const EnvsStats *recorded, BenchReport *report, MildError *error) {
    double rate = 0;
    EnvsStats stats = {0};
    MildStatus status = measure(envs, rows, def, script, &rate, &stats, error);
    if (status != MILD_OK) {
        return status;
    }
    if (stats.episodes != recorded->episodes || stats.falls != recorded->falls) {
        return mild_fail(error, MILD_ERROR_RANGE, "bench robots: the walk did not repeat itself");
    }
    bench_add(report, "robots", "walking_policy_steps_per_s", rate, "1/s");
    bench_add(report, "robots", "walking_episodes_ended", stats.episodes, "-");
    return MILD_OK;
}

/* ---- both ---- */

static MildStatus walk_twice(const EnvsDef *of, const ExperimentDef *def, const Rows *rows,
                             const Controller *controller, BenchReport *report, MildError *error) {
    const int steps = warm_steps(rows) + timed_steps(rows);
    const size_t numbers = (size_t)steps * (size_t)def->train.envs * (size_t)def->policy.actions;
    float *script = device_alloc(rows->device, numbers * sizeof *script, error);
    EnvsStats recorded = {0};
    Envs *envs = script ? envs_create(of, error) : NULL;
    MildStatus status =
        envs ? record(envs, def, rows, controller, script, &recorded, error) : error->status;
    envs_destroy(envs);
    envs = status == MILD_OK ? envs_create(of, error) : NULL;
    if (status == MILD_OK) {
        status = envs ? walk(envs, def, rows, script, &recorded, report, error) : error->status;
    }
    envs_destroy(envs);
    device_free(rows->device, script);
    return status;
}

/* The robots march; or, when there is a controller, walk. */
static MildStatus with_rows(const ExperimentDef *def, const Robot *robot, Pool *pool,
                            const Controller *controller, BenchReport *report, MildError *error) {
    const int device = train_device(&def->train);
    Rows rows = {.device = device < 0 ? MILD_BATCH_HOST : device};
    const EnvsDef of = {.task = &def->task,
                        .robot = robot,
                        .pool = pool,
                        .batch = 1,
                        .device = rows.device,
                        .count = def->train.envs,
                        .grounds = 4096,
                        .seed = def->train.seed};
    MildStatus status = rows_open(&rows, def, rows.device, error);
    if (status == MILD_OK && controller) {
        status = walk_twice(&of, def, &rows, controller, report, error);
    } else if (status == MILD_OK) {
        Envs *envs = envs_create(&of, error);
        status = envs ? march(envs, def, &rows, report, error) : error->status;
        envs_destroy(envs);
    }
    rows_close(&rows);
    return status;
}

MildStatus bench_robots(const ExperimentDef *def, BenchReport *report, MildError *error) {
    BenchContext c;
    ExperimentDef *own = &c.def;
    Controller controller;
    MildError unused;
    MildStatus status = bench_open(&c, def, error);
    if (status == MILD_OK) {
        status = with_rows(own, c.robot, c.pool, NULL, report, error);
    }
    /* a robot for which no policy ships only marches */
    if (status == MILD_OK && bench_walker(c.robot, c.pool, own->train.envs, &own->task, &controller,
                                          &unused) == MILD_OK) {
        own->task.assist = 0;
        status = with_rows(own, c.robot, c.pool, &controller, report, error);
        controller_destroy(&controller);
    }
    bench_close(&c);
    return status;
}
