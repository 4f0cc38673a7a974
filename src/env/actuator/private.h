/* Private to the layer: what an actuator holds. */
#ifndef ACTUATOR_PRIVATE_H
#define ACTUATOR_PRIVATE_H

#include "env/actuator/actuator.h"

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
    int lag;                           /* [physics steps] spacing, of actuator_use */
    TaskActuator motors;
};

#endif
