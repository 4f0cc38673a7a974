#include "drive/runner.h"

#include <math.h>
#include <stdio.h>

/* How far two states may disagree: twice what the walk of a trained robot shows, with pushes
 * (lab/drive/README.md, section 2). */
#define TURN_TIME 0.02   /* [s] in which the base may reach its limit from rest */
#define TIP_SLACK 5.0    /* [rad/s] by which it may tip faster than it turns */
#define JOINT_SLACK 10.0 /* [rad/s] by which a joint may move faster than it says */

/* The most that training sees (lab/drive/README.md, section 2). */
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

static double norm(const double v[3]) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* The base against its own angular velocity. Its heading may jump: nobody reads it. */
static int is_base_jump(double limit, double dt, const TaskSensors *before, const TaskSensors *now,
                        char *why, size_t size) {
    double change[3], dot = 0;
    for (int i = 0; i < 3; i++) {
        change[i] = now->omega[i] - before->omega[i];
        dot += now->gravity[i] * before->gravity[i];
    }
    const double tip = acos(fmin(fmax(dot, -1), 1)),
                 turn = fmax(norm(before->omega), norm(now->omega));
    if (norm(change) > limit / TURN_TIME * dt) {
        snprintf(why, size, "the turning of the base changed by %.1f rad/s in %.3f s", norm(change),
                 dt);
        return 1;
    }
    if (tip > (turn + TIP_SLACK) * dt) {
        snprintf(why, size, "the base tipped by %.2f rad in %.3f s, and turned at %.1f rad/s", tip,
                 dt, turn);
        return 1;
    }
    return 0;
}

/* Each joint against its own speed. */
static int is_joint_jump(const Robot *robot, double dt, const TaskSensors *before,
                         const TaskSensors *now, char *why, size_t size) {
    for (int i = 0; i < robot_joints(robot); i++) {
        const double way = fabs(now->q[i] - before->q[i]),
                     speed = fmax(fabs(now->qd[i]), fabs(before->qd[i]));
        if (way > (speed + JOINT_SLACK) * dt) {
            snprintf(why, size, "%s moved by %.2f rad in %.3f s, and says %.1f rad/s",
                     robot_joint_name(robot, i), way, dt, speed);
            return 1;
        }
    }
    return 0;
}

static int is_jump(const Robot *robot, const SensorLimits *limits, const StatePacket *before,
                   const StatePacket *state, char *why, size_t size) {
    /* at least a period, because a robot that is simulated step by step sends at other times than
     * its own */
    const double dt = fmax(1e-6 * (double)(state->time - before->time), TASK_PERIOD);
    const TaskSensors old = sensor_read(before, robot_joints(robot)),
                      now = sensor_read(state, robot_joints(robot));
    return (limits->turn > 0 && is_base_jump(limits->turn, dt, &old, &now, why, size)) ||
           (limits->speed > 0 && is_joint_jump(robot, dt, &old, &now, why, size));
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
TaskSensors sensor_read(const StatePacket *state, int joints) {
    TaskSensors reading = {{0}, {0}, {0}, {0}};
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

void sensor_clip(const Robot *robot, TaskSensors *reading) {
    for (int i = 0; i < 3; i++) {
        reading->omega[i] = clip(reading->omega[i], -SHOWN_TURN, SHOWN_TURN);
    }
    for (int i = 0; i < robot_joints(robot); i++) {
        reading->q[i] = clip(reading->q[i], robot_joint_low(robot)[i] - SHOWN_BEYOND,
                             robot_joint_high(robot)[i] + SHOWN_BEYOND);
        reading->qd[i] = clip(reading->qd[i], -SHOWN_SPEED, SHOWN_SPEED);
    }
}
