/* Whether sensors agree: with time, because a number that repeats is old, and with each other,
 * because an angle is the integral of its speed. Each state alone may be possible (sensor.h). */
#ifndef DRIVE_WATCH_H
#define DRIVE_WATCH_H

#include "drive/packet.h"
#include "drive/sensor.h"

typedef enum { WATCH_REPEAT, WATCH_TURN, WATCH_ANGLE, WATCH_CHECKS } WatchCheck;

/* Sums over the states whose weight falls by 1/e in 4 s. */
typedef struct {
    double sum, squares;
} Disagreement;

/* Bits that stay the same. */
typedef struct {
    int ticks;                      /* for so many */
    double moved;                   /* [rad] the way of a target from where it was then */
    float target[ROBOT_JOINTS_MAX]; /* [rad] then */
} Repeat;

/* Of one robot; zeros before the first state. */
typedef struct {
    int begun; /* bool */
    StatePacket before;
    double pace;                          /* [-] states that the robot sends in a period */
    double weight;                        /* of the states */
    Disagreement turn[3];                 /* [rad] the quaternion beside the gyro, own axes */
    Disagreement angle[ROBOT_JOINTS_MAX]; /* [rad] angles beside speeds */
    Repeat imu, joint[ROBOT_JOINTS_MAX];
    double share[WATCH_CHECKS]; /* [-] of a bound, the largest so far; a fault is above 1 */
} Watch;

/* A tick with a new state. target: [joints] the newest one sent. Bool: the sensors do not agree.
 * `why` says which. A limit of 0 (turn, speed) turns off the check of what it is of. */
int watch_disagrees(Watch *watch, const Robot *robot, const SensorLimits *limits,
                    const StatePacket *state, const float *target, char *why, size_t size);

#endif
