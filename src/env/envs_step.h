/* The arrays and numbers of a policy step of many environments: plain structs, which the learner,
 * other programs (envs/envs.h) and both backends share. */
#ifndef ENVS_STEP_H
#define ENVS_STEP_H

#include <stdint.h>

#include "env/task/view.h"

/* A policy step. Environments that ended begin a new episode in the same step, whose first
 * observation is the one written to `next`. */
typedef struct {
    const float *action; /* [envs][actions] in units of the action scale */
    float *reward;       /* [envs] */
    uint8_t *done;       /* [envs] bool: the episode ended in this step, fallen or by time */
    uint8_t *timeout;    /* [envs] bool: it ended by time; bootstrap from the value before it */
    uint8_t *valid;      /* [envs] bool: 0: the simulation diverged; give the sample no weight */
    uint8_t *cause;      /* [envs] TaskEnd (task/state.h) where done, else 0; NULL: not asked for */
    EnvsView next;       /* the observation after it */
    /* Of environments that ended, others are left alone. MuJoCo's only, else NULL. */
    EnvsView last; /* the observation at the end of the episode; 0 where it diverged. Not of a
                      NULL history */
    float *terms;  /* [envs][rewards] sum of each reward term over the episode */
} EnvsStep;

/* Where the robots are and how they move, in the order of robot.ini, on the device. Each may be
 * NULL. */
typedef struct {
    float *qpos;   /* [envs][7 + joints] [m, -, rad] base, quaternion w x y z, joints */
    float *qvel;   /* [envs][6 + joints] [m/s, rad/s] base: world axes, base axes; joints */
    float *torque; /* [envs][joints] [N m] of the last physics step */
} EnvsMotion;

enum { ENVS_TERMS_MAX = 32 };

/* Of the episodes that ended since the last call. Means of length, reward, speed_error and terms
 * are NaN where none ended. */
typedef struct {
    int episodes;                 /* that ended */
    int falls;                    /* of these, not by time */
    int diverged;                 /* steps */
    double steps;                 /* [-] policy steps of all environments */
    double paid;                  /* [-] sum of all rewards of these steps */
    double length;                /* [s] mean */
    double reward;                /* [-] mean sum of an episode */
    double speed_error;           /* [m/s] mean */
    double assist;                /* [-] mean level of assistance of all robots now */
    double terms[ENVS_TERMS_MAX]; /* [1/s] mean of each reward term while alive */
} EnvsStats;

#endif
