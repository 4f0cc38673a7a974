/* The actuator network (docs/actuator.md; Hwangbo et al. 2019): what a joint's motor and its drive
 * give, as a small network. Inputs are the errors of the joint's angle and its speeds now and at
 * two times before, the output is the torque. Joints with the same kind of motor share a network.
 * An Actuator is constant; what it remembers of a robot is in the robot's environment. */
#ifndef ACTUATOR_ACTUATOR_H
#define ACTUATOR_ACTUATOR_H

#include "env/task/task_def.h"
#include "mild/error.h"
#include "robot/robot.h"

enum {
    ACTUATOR_TIMES = 3,                   /* t, t - spacing, t - 2 spacing */
    ACTUATOR_INPUTS = 2 * ACTUATOR_TIMES, /* errors, then speeds, newest first */
    ACTUATOR_HIDDEN = 32                  /* width of both hidden layers, softsign */
};

/* [s] Of the history. */
#define ACTUATOR_SPACING_MIN 0.0005
#define ACTUATOR_SPACING_MAX 0.1

/* Units of a network's numbers: their root mean squares in training. */
typedef struct {
    double error;  /* [rad] */
    double speed;  /* [rad/s] */
    double torque; /* [N m] */
} ActuatorScale;

typedef struct Actuator Actuator;

/* Kinds of motors of a robot: joints with equal gains, effort and speed limit in robot.ini. Writes
 * the kind of each joint [robot_joints], numbered in the order of the joints; returns their
 * number. */
int actuator_kinds(const Robot *robot, int *kind);
void actuator_destroy(Actuator *actuator); /* may be NULL */

/* A safetensors file, written completely or not at all; note: free text. */
MildStatus actuator_save(const Actuator *actuator, const char *path, const char *note,
                         MildError *error);

/* Reads the file that the task names, if any, and sets task->motors. The caller destroys *actuator
 * (NULL: none) after the environments. Fails when it does not fit robot, physics step or gains. */
MildStatus actuator_open(TaskDef *task, const Robot *robot, Actuator **actuator, MildError *error);

#endif
