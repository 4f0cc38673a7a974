#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/random.h"
#include "bench/bench.h"
#include "bench/record.h"
#include "env/task/task.h"
#include "learn/cuda/learner.h"
#include "learn/network.h"

typedef struct {
    Policy *policy;
    Pool *pool;
    Ppo *ppo;
} Learner;

static void close_learner(Learner *l) {
    ppo_destroy(l->ppo);
    policy_destroy(l->policy);
    pool_destroy(l->pool);
}

/* Random numbers in the whole rollout: a device works harder, and slower, on them than on zeros. */
static void fill(const PpoBatch *batch) {
    const size_t samples = (size_t)batch->steps * (size_t)batch->envs,
                 floats = (size_t)((float *)(void *)batch->done - batch->history);
    Random random = random_at(1, 2, 3);
    float normal[4096];
    for (size_t i = 0; i < sizeof normal / sizeof *normal; i++) {
        normal[i] = (float)random_normal(&random);
    }
    for (size_t i = 0; i < floats; i++) { /* the arrays of numbers come one after the other */
        batch->history[i] = normal[(i + i / 4001) % (sizeof normal / sizeof *normal)];
    }
    memset(batch->done, 0, samples);
    memset(batch->timeout, 0, samples);
    memset(batch->valid, 1, samples);
}

static MildStatus fill_rollout(Ppo *ppo, MildError *error) {
    if (!ppo_is_resident(ppo)) {
        fill(ppo_batch(ppo));
        return MILD_OK;
    }
    PpoBatch batch;
    const size_t bytes = ppo_batch_like(ppo, NULL, &batch);
    void *block = aligned_alloc(64, (bytes + 63) / 64 * 64);
    if (!block) {
        return mild_fail(error, MILD_ERROR_MEMORY, "no memory for a rollout; lower train.envs");
    }
    ppo_batch_like(ppo, block, &batch);
    fill(&batch);
    const MildStatus status = gpu_learner_write(ppo, block, error);
    free(block);
    return status;
}

/* rows: see GpuLearnerDef. */
static MildStatus open_learner(Learner *l, const ExperimentDef *def, int rows, MildError *error) {
    Robot *robot = bench_robot(def, error);
    if (!robot) {
        return MILD_ERROR_IO;
    }
    ExperimentDef fitted = *def;
    experiment_fit_robot(&fitted, robot);
    const TaskMirror sides = task_mirror(&fitted.task, robot);
    const PpoMirror mirror = {sides.observation_index, sides.observation_sign, sides.action_index,
                              sides.action_sign};
    fitted.ppo.learning_rate = fitted.ppo.learning_rate_min = fitted.ppo.kl_target = 0.0;
    l->policy = policy_create(&fitted.policy, 1, error);
    l->pool = pool_create(fitted.train.threads);
    MildStatus status =
        l->policy && l->pool ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "no memory");
    if (!status) {
        l->ppo = ppo_create(&fitted.ppo, l->policy, l->pool, &mirror, fitted.train.envs, 1, error);
        status = l->ppo ? MILD_OK : MILD_ERROR_MEMORY;
    }
    if (!status && strncmp(def->train.device, "cuda", 4) == 0) {
        const GpuLearnerDef gpu = {.resident = 1, .rows = rows};
        status = gpu_learner_attach(l->ppo, &gpu, error);
    }
    robot_destroy(robot);
    return status ? status : fill_rollout(l->ppo, error);
}

/* Seconds of an iteration, with or without its rollout of `act`. */
static double iteration_seconds(Ppo *ppo, int acts, double least) {
    const double start = clock_seconds();
    int count = 0;
    do {
        PpoReport report;
        for (int t = 0; acts && t < ppo_batch(ppo)->steps; t++) {
            ppo_act(ppo, t);
        }
        ppo_update(ppo, &report);
        count++;
    } while (clock_seconds() - start < least);
    return (clock_seconds() - start) / count;
}

/* ---- work ---- */

/* Multiplications and additions of the products of one pass forward over a row. */
static double forward_flops(const Mlp *mlp) {
    double flops = 0.0;
    for (int l = 0; l < mlp->layers; l++) {
        flops += 2.0 * mlp->layer[l].in * mlp->layer[l].out;
    }
    return flops;
}

/* Forward, and the gradients of weights and inputs; that of the first input is not needed in
 * encoder and critic. */
static double training_flops(const Mlp *mlp, int first) {
    const double input = 2.0 * mlp->layer[0].in * mlp->layer[0].out;
    return 3.0 * forward_flops(mlp) - (first ? input : 0.0);
}

/* Per policy step. */
static void count_flops(const Policy *policy, const PpoDef *def, double *act, double *update) {
    Network n;
    network_layout(&n, policy_def(policy), NULL);
    const double images = def->mirror_weight > 0.0 ? 1.0 + def->mirror_share : 1.0;
    *act = forward_flops(&n.encoder) + forward_flops(&n.modulation) + forward_flops(&n.actor);
    *update =
        forward_flops(&n.critic) +
        def->epochs * (images * (training_flops(&n.encoder, 1) + training_flops(&n.modulation, 0) +
                                 training_flops(&n.actor, 0)) +
                       training_flops(&n.decoder, 0) + training_flops(&n.critic, 1));
}

static MildStatus measure(const ExperimentDef *def, int rows, BenchReport *report,
                          MildError *error) {
    const double steps = (double)def->train.envs * def->ppo.steps;
    Learner l = {0};
    MildStatus status = open_learner(&l, def, rows, error);
    if (!status) {
        double act_flops, update_flops;
        count_flops(l.policy, &def->ppo, &act_flops, &update_flops);
        for (int warm = 0; warm < 3; warm++) { /* loads kernels, captures the graph */
            iteration_seconds(l.ppo, 1, 0.0);
        }
        const double update = iteration_seconds(l.ppo, 0, 2.0) / steps,
                     both = iteration_seconds(l.ppo, 1, 2.0) / steps;
        status = ppo_status(l.ppo, error);
        char name[40];
        snprintf(name, sizeof name, rows > 0 ? "update_rows_%d" : "update", rows);
        bench_add(report, "update", name, 1e6 * update, "us/step");
        if (rows == 0) {
            bench_add(report, "update", "act", 1e6 * (both - update), "us/step");
            bench_add(report, "update", "act_and_update", 1e6 * both, "us/step");
            bench_add(report, "update", "flops", act_flops + update_flops, "1/step");
            bench_add(report, "update", "rate", 1e-12 * (act_flops + update_flops) / both,
                      "TFLOP/s");
            if (gpu_learner_bytes(l.ppo) > 0) {
                bench_add(report, "update", "device_memory", (double)gpu_learner_bytes(l.ppo), "B");
            }
        }
    }
    close_learner(&l);
    return status;
}

MildStatus bench_update(const ExperimentDef *def, BenchReport *report, MildError *error) {
    static const int chunks[] = {65536, 32768, 16384, 8192};
    const int cuda = strncmp(def->train.device, "cuda", 4) == 0;
    MildStatus status = measure(def, 0, report, error);
    for (size_t i = 0; cuda && !status && i < sizeof chunks / sizeof *chunks; i++) {
        status = measure(def, chunks[i], report, error);
    }
    return status;
}
