/* A recorded walk. Each policy period can be stepped again from the same state. */
#ifndef BENCH_REPLAY_H
#define BENCH_REPLAY_H

#include "robot/robot.h"

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

#endif
