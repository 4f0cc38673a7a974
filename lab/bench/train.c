#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "bench/bench.h"
#include "run/train/trainer.h"

/* Time inside the environments is summed over the threads, and so divided by their number. */
static void train_rows(const TrainTimes *sum, double steps, double wall, int threads,
                       BenchReport *report) {
    double ground = sum->ground / threads, physics = sum->physics / threads - ground;
    bench_add(report, "train", "policy_steps_per_s", steps / wall, "1/s");
    bench_add(report, "train", "physics", 1e6 * physics / steps, "us/step");
    bench_add(report, "train", "ground", 1e6 * ground / steps, "us/step");
    bench_add(report, "train", "task", 1e6 * (sum->environments - physics - ground) / steps,
              "us/step");
    bench_add(report, "train", "inference", 1e6 * sum->inference / steps, "us/step");
    bench_add(report, "train", "update", 1e6 * sum->update / steps, "us/step");
    bench_add(report, "train", "other",
              1e6 * (wall - sum->environments - sum->inference - sum->update) / steps, "us/step");
    bench_add(report, "train", "threads", threads, "-");
}

MildStatus bench_train(const ExperimentDef *def, BenchReport *report, MildError *error) {
    const double seconds = 20;
    Trainer *trainer = train_create(def, error);
    if (!trainer) {
        return error->status;
    }
    TrainReport iteration;
    TrainTimes sum = {0};
    MildStatus status = train_iterate(trainer, &iteration,
                                      error); /* fills caches, lets oneDNN compile its kernels */
    double start = clock_seconds(), wall = 0, steps = 0;
    while (status == MILD_OK && wall < seconds) {
        status = train_iterate(trainer, &iteration, error);
        sum.environments += iteration.times.environments;
        sum.inference += iteration.times.inference;
        sum.update += iteration.times.update;
        sum.physics += iteration.times.physics;
        sum.ground += iteration.times.ground;
        steps += (double)def->train.envs * def->ppo.steps;
        wall = clock_seconds() - start;
    }
    if (status == MILD_OK) {
        train_rows(&sum, steps, wall, train_threads(trainer), report);
    }
    train_destroy(trainer);
    return status;
}

/* A field of /proc/self/status in bytes; 0 where there is none. */
static double process_bytes(const char *key) {
    char line[256];
    double kibibytes = 0;
    FILE *file = fopen("/proc/self/status", "r");
    while (file && fgets(line, sizeof line, file)) {
        if (strncmp(line, key, strlen(key)) == 0) {
            kibibytes = strtod(line + strlen(key), NULL);
        }
    }
    if (file) {
        fclose(file);
    }
    return 1024 * kibibytes;
}

MildStatus bench_memory(const ExperimentDef *def, BenchReport *report, MildError *error) {
    Trainer *trainer = train_create(def, error);
    if (!trainer) {
        return error->status;
    }
    TrainReport iteration;
    if (train_iterate(trainer, &iteration, error)) { /* touches every page once */
        train_destroy(trainer);
        return error->status;
    }
    bench_add(report, "memory", "envs", def->train.envs, "-");
    bench_add(report, "memory", "training", (double)train_bytes(trainer), "B");
    bench_add(report, "memory", "process_peak", process_bytes("VmHWM:"), "B");
    train_destroy(trainer);
    return MILD_OK;
}
