/* The robot of train.robot, and a record of it walking under the shipped policy. */
#ifndef BENCH_RECORD_H
#define BENCH_RECORD_H

#include "control/controller.h"
#include "robot/robot.h"
#include "run/train/experiment.h"

/* ---- a recorded walk. Each policy period can be stepped again from the same state ---- */

enum { REPLAY_STEPS_MAX = 100 }; /* physics steps of a period */

/* One period: the state and the ground's memory before it, and the torques of its physics steps. */
typedef struct {
    RobotState state;
    MildGround *ground;
    double torque[REPLAY_STEPS_MAX][ROBOT_JOINTS_MAX];
} ReplayPeriod;

typedef struct {
    int periods, steps; /* steps: of each period */
    double dt;          /* [s] */
    RobotVariation variation;
    MildTerrain terrain;
    ReplayPeriod *period; /* [periods] */
} Replay;

/* NULL when out of memory. The periods are empty, the ground's memories untouched. */
Replay *replay_create(const Robot *robot, int periods, int steps, double dt, MildError *error);
void replay_destroy(Replay *replay); /* may be NULL */

/* When a contact solver stops, see robot_sim_set_solver. */
typedef struct {
    double tolerance;
    int iterations;
    int in_float; /* bool: on float_ground.h */
} ReplayStop;

/* Means over all steps, from the least of the repeats of each period [us per physics step]. */
typedef struct {
    double tight;             /* robot_sim_step on the ground, Newton with its default tolerance */
    double loose;             /* the same with the tolerance `loose` */
    double engine;            /* mj_step from the same states; the floor is lowered to the soles
                                 that sank into soft ground */
    double tight_iterations;  /* per step */
    double loose_iterations;  /* per step */
    double loose_unconverged; /* [-] share of the steps */
} ReplayTimes;

/* Times the recorded walk. The cases take turns at every period. */
MildStatus replay_time(const Replay *replay, const Robot *robot, ReplayStop loose, int repeats,
                       ReplayTimes *times, MildError *error);

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
