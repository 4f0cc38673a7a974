/* Cost of a physics step of the robot, compared with the engine's own contact. */
#ifndef BENCH_STEP_H
#define BENCH_STEP_H

#include "robot/phases.h"

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
                            int steps, RobotBench *result, MildError *error);

#endif
