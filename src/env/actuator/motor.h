/* A made-up motor to try the actuator network on, and to compare it with: the PD of the joint,
 * late, limited by a torque-speed curve, less friction.
 *
 *   asked(t) = kp error(t - delay) - kd speed(t - delay)
 *   most     = peak effort min(1, 2 (1 - |speed|/limit)) where asked and speed have one sign,
 *              peak effort otherwise
 *   torque   = clip(asked, most) - effort (coulomb tanh(speed/0.3 rad/s) + viscous speed/limit)
 *
 * with gains, effort and speed limit of robot.ini (limit 25 rad/s where it has none). */
#ifndef ACTUATOR_MOTOR_H
#define ACTUATOR_MOTOR_H

#include "env/task/task_def.h"
#include "robot/robot.h"

typedef struct {
    double delay;   /* [s] in whole physics steps */
    double coulomb; /* [-] of the effort */
    double viscous; /* [-] of the effort, at the speed limit */
    double peak;    /* [-] of the effort */
} MotorDef;

typedef struct {
    MotorDef def;
    const Robot *robot; /* borrowed */
    int lag;            /* [physics steps] delay */
    TaskActuator motors;
} Motor;

MotorDef motor_def_default(void);
/* motor: must stay where it is while motor->motors is in use. dt: [s] physics step. */
void motor_init(Motor *motor, const MotorDef *def, const Robot *robot, double dt);

#endif
