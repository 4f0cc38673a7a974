/* Measurements of this machine: a bench fills rows, the command prints and saves them. */
#ifndef MILD_BENCH_H
#define MILD_BENCH_H

#include "app/experiment.h"

enum { BENCH_ROWS_MAX = 64 };

typedef struct {
    const char *bench, *name, *unit; /* name: the case */
    double value;
} BenchRow;

typedef struct {
    BenchRow rows[BENCH_ROWS_MAX];
    int count;
} BenchReport;

void bench_add(BenchReport *report, const char *bench, const char *name, double value, const char *unit);

/* One physics step of the robot standing on sand: ours beside the engine's own contact, in turns, medians. */
MildStatus bench_step(const ExperimentDef *def, BenchReport *report, MildError *error);
/* The ground alone: solve and advance of two soles, 154 elements in contact. */
MildStatus bench_ground(const ExperimentDef *def, BenchReport *report, MildError *error);
/* Training end to end, with where the time goes. */
MildStatus bench_train(const ExperimentDef *def, BenchReport *report, MildError *error);
/* Bytes held by a training run of train.envs robots. */
MildStatus bench_memory(const ExperimentDef *def, BenchReport *report, MildError *error);

#endif
