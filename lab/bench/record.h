/* The robot of train.robot, and a record of it walking under the shipped policy. */
#ifndef BENCH_RECORD_H
#define BENCH_RECORD_H

#include "bench/replay.h"
#include "control/controller.h"
#include "run/train/experiment.h"

/* NULL, with the reason in *error. */
Robot *bench_robot(const ExperimentDef *def, MildError *error);
/* What benches of environments have in common: the experiment fitted to its robot, without patches,
 * which the batch engine has on maps only. Close it, whatever comes out. */
typedef struct {
    ExperimentDef def;
    Robot *robot;
    Pool *pool;
} BenchContext;
MildStatus bench_open(BenchContext *c, const ExperimentDef *def, MildError *error);
void bench_close(BenchContext *c);
/* The policy that ships for a robot, for `envs` of them, and in *task how its file says that it
 * walks. */
MildStatus bench_walker(const Robot *robot, Pool *pool, int envs, TaskDef *task,
                        Controller *controller, MildError *error);
/* Records the shipped policy at 0.6 m/s on a ground (scene.h), of its own law or matched to a
 * model whose soles the robot has (RandomizeDef.model); replay_destroy it. NULL when it falls, is a
 * policy of another robot, or when the ground has no match. */
Replay *bench_record_walk(const ExperimentDef *def, const Robot *robot, const char *ground,
                          int model, int periods, MildError *error);

#endif
