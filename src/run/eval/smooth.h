/* How smoothly a robot moves: what is asked of its joints, and what base and joints do, after each
 * policy step. */
#ifndef MILD_SMOOTH_H
#define MILD_SMOOTH_H

#include "env/trial.h"

#define SMOOTH_JERK_STEPS 2   /* policy steps: 20 ms, in which nanoG1 decides once */
#define SMOOTH_JERK_UNIT 0.25 /* [rad] per unit action of nanoG1 */

/* Sums over the policy steps that begin at `from` or later. */
typedef struct {
    int steps;    /* so far, counted or not */
    int counted;  /* of them */
    int targets;  /* of these, those in which targets were commanded, not torques */
    double tilt;  /* [rad^2/s^2] squares of roll and pitch rate */
    double yaw;   /* [rad^2/s^2] squares of the yaw rate */
    double joint; /* [rad^2/s^2] squares of the joint speeds, mean over the joints */
    double jerk;  /* [rad^2] squares of the targets' changes in 20 ms, mean over the joints */
    double jump;  /* [rad] largest change of a target in a policy step */
    double target[SMOOTH_JERK_STEPS][ROBOT_JOINTS_MAX]; /* [rad] latest first */
} Smooth;

/* Of trials; NaN: nothing was counted. */
typedef struct {
    double
        target_jump; /* [rad] largest change of a joint's target from a policy step to the next */
    double action_jerk; /* [0.25 rad] root mean square over joints of its change in 20 ms */
    double tilt_rate;   /* [rad/s] of roll and pitch rate: the root of the mean of the sum of both
                           squares */
    double yaw_rate;    /* [rad/s] root mean square, about the base's own axis */
    double joint_speed; /* [rad/s] root mean square over joints */
} Smoothness;

/* A policy step of `period` [s]. after: its last physics step. action: clipped to +-clip, it moves
 * a target by `scale` [rad]; NULL: torques were commanded. */
void smooth_take(Smooth *smooth, double from, double period, const EnvsSample *after,
                 const float *action, double scale, double clip);
/* Adds a trial's sums to those of others. */
void smooth_add(Smooth *sum, const Smooth *trial);
Smoothness smooth_result(const Smooth *sum);

#endif
