#include "env/actuator/motor.h"

#include <math.h>
#include <string.h>

#define FRICTION_SPEED 0.3 /* [rad/s] */
#define SPEED_LIMIT 25.0   /* [rad/s] of a robot that names none */

/* The last lag + 1 torques that were asked for, as a ring of rows [joints]. */
typedef struct {
    int64_t count;
    double asked[];
} MotorMemory;

MotorDef motor_def_default(void) {
    return (MotorDef){.delay = 0.005, .coulomb = 0.02, .viscous = 0.1, .peak = 0.5};
}

static double motor_torque(const Motor *motor, int joint, double asked, double speed) {
    const double effort = robot_effort(motor->robot)[joint],
                 named = robot_speed(motor->robot)[joint];
    const double limit = named > 0 ? named : SPEED_LIMIT;
    const double slack = asked * speed > 0 ? fmax(2 * (1 - fabs(speed) / limit), 0) : 1;
    const double most = motor->def.peak * effort * fmin(1, slack);
    const double friction =
        motor->def.coulomb * tanh(speed / FRICTION_SPEED) + motor->def.viscous * speed / limit;
    return fmin(fmax(asked, -most), most) - effort * friction;
}

static void torque_of_joints(const void *self, void *state, const double *error,
                             const double *speed, double *torque) {
    const Motor *motor = self;
    MotorMemory *memory = state;
    const int joints = robot_joints(motor->robot);
    const int64_t held = motor->lag + 1, now = memory->count++;
    const int64_t then = now > motor->lag ? now - motor->lag : 0;
    for (int i = 0; i < joints; i++) {
        memory->asked[now % held * joints + i] =
            robot_kp(motor->robot)[i] * error[i] - robot_kd(motor->robot)[i] * speed[i];
    }
    for (int i = 0; i < joints; i++) {
        torque[i] = motor_torque(motor, i, memory->asked[then % held * joints + i], speed[i]);
    }
}

void motor_init(Motor *motor, const MotorDef *def, const Robot *robot, double dt) {
    const int lag = (int)lround(def->delay / dt);
    const size_t bytes =
        sizeof(MotorMemory) + (size_t)(lag + 1) * (size_t)robot_joints(robot) * sizeof(double);
    *motor = (Motor){.def = *def,
                     .robot = robot,
                     .lag = lag,
                     .motors = {motor, (bytes + 63) / 64 * 64, torque_of_joints}};
}
