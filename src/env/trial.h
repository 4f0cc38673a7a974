/* Trials of an evaluation: what each has instead of what an episode draws, and what is measured of
 * it. */
#ifndef ENVS_TRIAL_H
#define ENVS_TRIAL_H

#include <stdint.h>

#include "robot/limits.h"

/* What the caller chose for an environment, which then draws neither ground nor command: a trial of
 * an evaluation. */
typedef struct {
    uint32_t stream; /* number that selects its random numbers */
    int ground;      /* of EnvsDef.terrain */
    int rigid;       /* bool: on the engine's own contact, with TASK_RIGID_FRICTION */
} EnvsTrial;

/* What is measured of a foot. */
typedef struct {
    double load;      /* [N] vertical force of the ground on the foot */
    double center[2]; /* [m] centre of the sole, world */
    double height;    /* [m] lowest sole point above the undisturbed ground */
    double depth;     /* [m] deepest element; 0 on rigid ground */
    /* by MuJoCo, else unset: see RobotFoot */
    double position[3], rotation[9], force[3], torque[3];
} EnvsFoot;

/* A physics step, for the measures of an evaluation. The batch engine computes in float. */
typedef struct {
    int valid;                       /* bool: the step was made; 0 from a divergence on */
    int joints, feet;                /* of the robot */
    double base[3];                  /* [m] world */
    double above;                    /* [m] height of the base above the ground under it */
    double quaternion[4];            /* [-] base -> world, w x y z */
    double omega[3];                 /* [rad/s] of the base, its own axes */
    double legs;                     /* [m] least distance of two legs: robot_sim_leg_distance */
    double shell_load;               /* [N] vertical force of the ground on the shells */
    double mass_center[3];           /* [m] of the robot, world; by MuJoCo, else NaN */
    double torque[ROBOT_JOINTS_MAX]; /* [N m] */
    double speed[ROBOT_JOINTS_MAX];  /* [rad/s] of the joints after the step */
    EnvsFoot foot[ROBOT_FEET_MAX];
} EnvsSample;

#endif
