/* Private to the layer: what an actuator holds. */
#ifndef ACTUATOR_PRIVATE_H
#define ACTUATOR_PRIVATE_H

#include "env/actuator/actuator.h"
#include "learn/mlp.h"

enum { ACTUATOR_NAME_SIZE = 64 };

typedef struct {
    ActuatorScale scale;
    float *parameters; /* as actuator_mlp */
    float *forward;    /* weights [in][out] and biases, layer by layer, for one row at a time */
} ActuatorNet;

struct Actuator {
    char robot[ACTUATOR_NAME_SIZE];
    char joints[ROBOT_JOINTS_MAX * ACTUATOR_NAME_SIZE]; /* their names, with blanks between */
    double spacing;                                     /* [s] of the history */
    int joint_count;
    int kind[ROBOT_JOINTS_MAX];
    int kinds;
    ActuatorNet net[ROBOT_JOINTS_MAX]; /* [kinds] */
    int lag;                           /* [physics steps] spacing, of actuator_open */
    TaskActuator motors;
};

/* The network that all kinds have. */
Mlp actuator_mlp(void);
int actuator_parameters(void); /* their number, of one kind */

/* Parameters are 0, scales 1. NULL when out of memory. */
Actuator *actuator_create(const Robot *robot, double spacing, MildError *error);
/* Takes the network of a kind: parameters laid out as actuator_mlp. */
void actuator_set(Actuator *actuator, int kind, ActuatorScale scale, const float *parameters);
/* [N m] Torque of a joint. error [rad], speed [rad/s]: [ACTUATOR_TIMES] newest first. */
double actuator_torque(const Actuator *actuator, int joint, const double *error,
                       const double *speed);
/* Fails when the file is of another robot. */
Actuator *actuator_load(const char *path, const Robot *robot, MildError *error);

#endif
