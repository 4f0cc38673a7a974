#include "drive/sensor.h"

#include <math.h>
#include <stdio.h>

#define SLACK 1.5 /* [-] of what the limits allow between two states, because clocks jitter */

/* The most that training sees (docs/drive.md, section 2). */
#define SHOWN_TURN 5.0   /* [rad/s] of the base, each axis */
#define SHOWN_SPEED 50.0 /* [rad/s] of a joint */
#define SHOWN_BEYOND 0.3 /* [rad] beyond the joint's range */

/* ---- what cannot be ---- */

static int is_joint_impossible(const Robot *robot, const SensorLimits *limits, int joint, double q,
                               double qd, char *why, size_t size) {
    const double beyond =
        fmax(robot_joint_low(robot)[joint] - q, q - robot_joint_high(robot)[joint]);
    if (limits->speed > 0 && fabs(qd) > limits->speed) {
        snprintf(why, size, "%s moves at %.1f rad/s, the limit is %g",
                 robot_joint_name(robot, joint), fabs(qd), limits->speed);
        return 1;
    }
    if (limits->angle >= 0 && beyond > limits->angle) {
        snprintf(why, size, "%s is %.2f rad beyond its range, the limit is %g",
                 robot_joint_name(robot, joint), beyond, limits->angle);
        return 1;
    }
    return 0;
}

/* [rad] between two orientations. */
static double turned(const float a[4], const float b[4]) {
    double dot = 0;
    for (int i = 0; i < 4; i++) {
        dot += (double)a[i] * (double)b[i];
    }
    return 2 * acos(fmin(fabs(dot), 1));
}

static int is_jump(const Robot *robot, const SensorLimits *limits, const StatePacket *before,
                   const StatePacket *state, char *why, size_t size) {
    /* at least a period, because packets of a robot that is simulated step by step have no times
     * of their own */
    const double dt = fmax(1e-6 * (double)(state->time - before->time), TASK_PERIOD);
    const double turn = turned(before->quaternion, state->quaternion);
    if (limits->turn > 0 && turn > SLACK * limits->turn * dt) {
        snprintf(why, size, "the base turned by %.2f rad in %.3f s", turn, dt);
        return 1;
    }
    for (int i = 0; i < robot_joints(robot) && limits->speed > 0; i++) {
        const double way = fabs((double)state->angle[i] - (double)before->angle[i]);
        if (way > SLACK * limits->speed * dt) {
            snprintf(why, size, "%s moved by %.2f rad in %.3f s", robot_joint_name(robot, i), way,
                     dt);
            return 1;
        }
    }
    return 0;
}

int sensor_is_impossible(const Robot *robot, const SensorLimits *limits, const StatePacket *before,
                         const StatePacket *state, char *why, size_t size) {
    double square = 0;
    for (int i = 0; i < 3; i++) {
        square += (double)state->angular_velocity[i] * (double)state->angular_velocity[i];
    }
    if (limits->turn > 0 && square > limits->turn * limits->turn) {
        snprintf(why, size, "the base turns at %.1f rad/s, the limit is %g", sqrt(square),
                 limits->turn);
        return 1;
    }
    for (int i = 0; i < robot_joints(robot); i++) {
        if (is_joint_impossible(robot, limits, i, (double)state->angle[i], (double)state->speed[i],
                                why, size)) {
            return 1;
        }
    }
    return before && is_jump(robot, limits, before, state, why, size);
}

/* ---- what the policy is shown ---- */

/* Gravity is minus the third row of the rotation that the quaternion stands for. */
TaskReading sensor_read(const StatePacket *state, int joints) {
    TaskReading reading = {{0}, {0}, {0}, {0}};
    const double w = (double)state->quaternion[0], x = (double)state->quaternion[1],
                 y = (double)state->quaternion[2], z = (double)state->quaternion[3];
    reading.gravity[0] = -2 * (x * z - w * y);
    reading.gravity[1] = -2 * (y * z + w * x);
    reading.gravity[2] = 2 * (x * x + y * y) - 1;
    for (int i = 0; i < 3; i++) {
        reading.omega[i] = (double)state->angular_velocity[i];
    }
    for (int i = 0; i < joints; i++) {
        reading.q[i] = (double)state->angle[i];
        reading.qd[i] = (double)state->speed[i];
    }
    return reading;
}

static double clip(double x, double low, double high) {
    return fmin(fmax(x, low), high);
}

void sensor_clip(const Robot *robot, TaskReading *reading) {
    for (int i = 0; i < 3; i++) {
        reading->omega[i] = clip(reading->omega[i], -SHOWN_TURN, SHOWN_TURN);
    }
    for (int i = 0; i < robot_joints(robot); i++) {
        reading->q[i] = clip(reading->q[i], robot_joint_low(robot)[i] - SHOWN_BEYOND,
                             robot_joint_high(robot)[i] + SHOWN_BEYOND);
        reading->qd[i] = clip(reading->qd[i], -SHOWN_SPEED, SHOWN_SPEED);
    }
}
