/* Where the time of a physics step goes, and how it compares with the engine's own contact. */
#ifndef ROBOT_BENCH_H
#define ROBOT_BENCH_H

#include "robot/robot.h"

/* Seconds and steps, summed while attached to a workspace. */
typedef struct {
    double smooth; /* [s] mass matrix, factor, bias, smooth acceleration */
    double map;    /* [s] A = J M^-1 J^T and the free twist */
    double ground; /* [s] mild_ground_solve and mild_ground_advance, or the engine's collision when
                      rigid */
    double finish; /* [s] wrench, joint limits or engine contact solver, integration, next pose */
    long steps;
} RobotPhases;

/* phases: NULL stops the timing. */
void robot_sim_time_phases(RobotSim *sim, RobotPhases *phases);

/* Medians over the repeats of one run in which the cases take turns [us per physics step]. The
 * robot stands balanced (stand.h); the engine's rows use mj_step on the same model and pose. */
typedef struct {
    double engine_free;        /* mj_step, hanging: no contact */
    double engine_rigid;       /* mj_step, eight sole corners on its floor */
    double rigid;              /* robot_sim_step, rigid variation */
    double newton;             /* robot_sim_step on the soft ground, Newton */
    double gauss_seidel;       /* robot_sim_step on the soft ground, the paper's sweeps */
    RobotPhases newton_phases; /* [us] of the Newton case: phases, with `steps` = 1 */
    double iterations;         /* mean Newton iterations per step */
} RobotBench;

/* preset: ground of the soft cases, e.g. "sand_loose"; repeats of `steps` steps per case. */
MildStatus robot_bench_step(const Robot *robot, const char *preset, double dt, int repeats,
                            int steps, RobotBench *bench, MildError *error);

#endif
