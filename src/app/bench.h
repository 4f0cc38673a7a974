/* Measurements of this machine: a bench fills rows, the command prints and saves them. */
#ifndef MILD_BENCH_H
#define MILD_BENCH_H

#include "app/experiment.h"
#include "robot/replay.h"

enum { BENCH_ROWS_MAX = 128 };

typedef struct {
    const char *bench, *unit;
    char name[40]; /* the case */
    double value;
} BenchRow;

typedef struct {
    BenchRow rows[BENCH_ROWS_MAX];
    int count;
} BenchReport;

void bench_add(BenchReport *report, const char *bench, const char *name, double value,
               const char *unit);

/* The shipped robot; NULL, with the reason in *error. */
Robot *bench_robot(MildError *error);
/* Records the shipped policy at 0.6 m/s on a ground (scene.h); replay_destroy it. NULL when it
 * falls, too. */
Replay *bench_record_walk(const ExperimentDef *def, const Robot *robot, const char *ground,
                          int periods, MildError *error);

/* One physics step of the robot standing on sand: ours beside the engine's own contact, in turns,
 * medians. */
MildStatus bench_step(const ExperimentDef *def, BenchReport *report, MildError *error);
/* The ground alone: solve and advance of two soles, 154 elements in contact. */
MildStatus bench_ground(const ExperimentDef *def, BenchReport *report, MildError *error);
/* Solve and advance of two plates, 20 to 2000 elements together, standing and slipping. */
MildStatus bench_elements(const ExperimentDef *def, BenchReport *report, MildError *error);
/* Newton against the paper's sweeps on the same problems, both stopped at the same error. */
MildStatus bench_solver(const ExperimentDef *def, BenchReport *report, MildError *error);
/* The physics steps of the shipped policy's walk: ours beside the engine's own contact. */
MildStatus bench_walk(const ExperimentDef *def, BenchReport *report, MildError *error);
/* Training end to end, with where the time goes. */
MildStatus bench_train(const ExperimentDef *def, BenchReport *report, MildError *error);
/* Bytes held by a training run of train.envs robots. */
MildStatus bench_memory(const ExperimentDef *def, BenchReport *report, MildError *error);

#endif
