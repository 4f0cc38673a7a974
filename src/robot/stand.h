/* Standing still, for tests and benchmarks. */
#ifndef ROBOT_STAND_H
#define ROBOT_STAND_H

#include "robot/robot.h"

/* tau = Kp (q0 - q) - Kd qd on the default pose, Kp 240 (hips, knees) and 200 (ankles) N m/rad, Kd 6 and 1 N m s/rad, within the
 * efforts. balance: bool, adds the feedback of the base's tilt that soft ground needs (see stand.c). torque: [ROBOT_JOINTS]. */
void robot_stand_torque(const Robot *robot, const RobotSim *sim, int balance, double *torque);

/* The robot at rest in its default pose, soles `sinkage` [m] below z = 0. */
RobotState robot_stand_state(const Robot *robot, double sinkage);

/* Depth [m] at which `elements` elements carry `weight` [N] by the element law alone. */
double robot_static_sinkage(const MildMaterial *material, double pitch, int elements, double weight);

#endif
