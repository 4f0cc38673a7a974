/* Measurements of speed and memory on this machine, one function each. */
#ifndef BENCH_BENCH_H
#define BENCH_BENCH_H

#include "bench/report.h"
#include "run/train/experiment.h"

/* One physics step of the robot standing on sand, with our contact and with the engine's own.
 * The cases take turns; medians. */
MildStatus bench_step(const ExperimentDef *def, BenchReport *report, MildError *error);
/* The ground alone: solve and advance of two soles, 154 elements in contact. */
MildStatus bench_ground(const ExperimentDef *def, BenchReport *report, MildError *error);
/* Solve and advance of two plates, 20 to 2000 elements together, standing and slipping. */
MildStatus bench_elements(const ExperimentDef *def, BenchReport *report, MildError *error);
/* The physics steps of a walk of the shipped policy, with our contact and with the engine's own. */
MildStatus bench_walk(const ExperimentDef *def, BenchReport *report, MildError *error);
/* The ground in batches on train.device: steps per second along a walk, and how near in float. */
MildStatus bench_batch(const ExperimentDef *def, BenchReport *report, MildError *error);
/* The environments alone on train.device: batch engine, ground and task under no action but the
 * assistance. */
MildStatus bench_robots(const ExperimentDef *def, BenchReport *report, MildError *error);
/* The learner alone on train.device, from a rollout of random numbers. */
MildStatus bench_update(const ExperimentDef *def, BenchReport *report, MildError *error);
/* Training as a whole, and how its time is spent. */
MildStatus bench_train(const ExperimentDef *def, BenchReport *report, MildError *error);
/* Bytes held by a training run of train.envs robots. */
MildStatus bench_memory(const ExperimentDef *def, BenchReport *report, MildError *error);

#endif
