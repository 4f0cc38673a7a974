/* What the ground did to the feet of every trial: a row for each foot after each physics step. */
#ifndef MILD_FEET_H
#define MILD_FEET_H

#include <stdio.h>

#include "env/trial.h"
#include "robot/robot.h"

/* Of one foot in a physics step. */
typedef struct {
    double ankle[3];            /* [m] world, at its end, like the rotation */
    double rotation[3];         /* [rad] roll, pitch, yaw: about x, then y, then z of the world */
    double force[3], torque[3]; /* [N, N m] on the foot, torque about the ankle, world */
    double center[2];           /* [m] where the force meets the sole's plane, foot's frame */
    double depth;               /* [m] deepest element */
    double height;              /* [m] lowest sole point above the undisturbed ground, at its end */
} FeetRow;

/* row: [trials][steps][feet]; the first count[trial] steps of a trial are there. */
typedef struct {
    int trials, steps, feet;
    double sole[ROBOT_FEET_MAX]; /* [m] height of the sole's plane in the foot's frame */
    FeetRow *row;
    int *count; /* [trials] */
} Feet;

/* steps: physics steps of a trial, at most. */
MildStatus feet_make(Feet *feet, const Robot *robot, int trials, int steps, MildError *error);
void feet_free(Feet *feet);
/* Adds a physics step. */
void feet_take(Feet *feet, int trial, const EnvsSample *sample);
/* The names of the columns, and the rows; period: [s] of a physics step. */
void feet_print_header(FILE *csv);
void feet_print(const Feet *feet, const char *ground, double speed, double period, FILE *csv);

#endif
