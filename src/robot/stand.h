/* Standing still, for tests and benchmarks. */
#ifndef ROBOT_STAND_H
#define ROBOT_STAND_H

#include "robot/robot.h"

/* tau = Kp (q0 - q) - Kd qd, Kp 240 (hips, knees) and 200 (ankles) N m/rad, Kd 6 and 1 N m s/rad,
 * within the efforts. balance 0: q0 is the default pose. balance 1: what soft ground needs (see
 * stand.c): q0 leans until the centre of mass is over the middle of the soles, the weight is fed
 * forward, and q0 answers the base's tilt. torque: [ROBOT_JOINTS]. */
void robot_stand_torque(const Robot *robot, const RobotSim *sim, int balance, double *torque);

/* The same without the answer to the tilt, from the joints' positions and velocities alone. */
void robot_stand_pd(const Robot *robot, int balance, const double *q, const double *qd,
                    double *torque);

/* The robot at rest in that pose, soles `sinkage` [m] below z = 0. */
RobotState robot_stand_state(const Robot *robot, int balance, double sinkage);

#endif
