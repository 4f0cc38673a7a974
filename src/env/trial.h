/* Trials of an evaluation by the batch engine: what each has instead of what an episode draws, and
 * what is measured of it. */
#ifndef ENVS_TRIAL_H
#define ENVS_TRIAL_H

#include <stdint.h>

#include "robot/limits.h"

/* What the caller chose for an environment, which then draws neither ground nor command: a trial of
 * an evaluation. */
typedef struct {
    uint32_t stream; /* number that selects its random numbers */
    int ground;      /* of EnvsDef.chosen */
    int rigid;       /* bool: on the engine's own contact, with TASK_RIGID_FRICTION */
} EnvsTrial;

/* A physics step, for the measures of an evaluation. */
typedef struct {
    int valid;                      /* bool: the step was made; 0 from a divergence on */
    float base[3];                  /* [m] world */
    float above;                    /* [m] height of the base above the ground under it */
    float quaternion[4];            /* [-] base -> world, w x y z */
    float torque[ROBOT_JOINTS_MAX]; /* [N m] */
    float speed[ROBOT_JOINTS_MAX];  /* [rad/s] after the step */
    struct {
        float load;      /* [N] vertical force of the ground */
        float center[2]; /* [m] centre of the sole, world */
        float height;    /* [m] lowest sole point above the undisturbed ground */
        float depth;     /* [m] deepest element; 0 on rigid ground */
    } foot[ROBOT_FEET_MAX];
} EnvsSample;

#endif
