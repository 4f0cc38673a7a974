/* Standing still: a PD about the default pose, with the balance that soft ground needs. For tests,
 * benchmarks and the controller `stand`. */
#ifndef CONTROL_STAND_H
#define CONTROL_STAND_H

#include "robot/robot.h"

/* Constants of a robot's balanced stand. They never change once made, so they may be shared. */
typedef struct Stand Stand;

/* Borrows the robot. NULL when out of memory. */
Stand *stand_create(const Robot *robot, MildError *error);
void stand_destroy(Stand *stand); /* may be NULL */

/* tau = Kp (q0 - q) - Kd qd with stand_kp and stand_kd of robot.ini, within the efforts. balance 0:
 * q0 is the default pose. balance 1: what soft ground needs (see stand.c): q0 leans until the
 * centre of mass is over the middle of the soles, the weight is fed forward, and q0 answers the
 * base's tilt. torque: [robot_joints]. */
void stand_torque(const Stand *stand, const RobotSim *sim, int balance, double *torque);

/* The same without the response to tilt, from joint positions and velocities alone. */
void stand_pd(const Stand *stand, int balance, const double *q, const double *qd, double *torque);

/* [rad] Joint targets [robot_joints] for which a PD with these gains gives the balanced torque,
 * apart from the effort limits. */
void stand_target(const Stand *stand, const RobotSim *sim, double *target);

/* The robot at rest in that pose, soles `sinkage` [m] below z = 0. */
RobotState stand_state(const Stand *stand, int balance, double sinkage);

#endif
