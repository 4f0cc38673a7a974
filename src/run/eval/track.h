/* Where the centre of mass and the base of every trial went: a point after each policy step. */
#ifndef MILD_TRACK_H
#define MILD_TRACK_H

#include <stdio.h>

#include "env/trial.h"
#include "mild/error.h"
#include "robot/robot.h"

typedef struct {
    double mass_center[3]; /* [m] of the whole robot, world */
    double base[3];        /* [m] world */
    double roll, pitch;    /* [rad] of the base; positive pitch: forward */
} TrackPoint;

/* point: [trials][steps]; the first count[trial] of a trial are there. */
typedef struct {
    int trials, steps;
    TrackPoint *point;
    int *count; /* [trials] */
} Track;

MildStatus track_make(Track *track, int trials, int steps, MildError *error);
void track_free(Track *track);
/* Adds the point of a physics step. */
void track_take(Track *track, int trial, const EnvsSample *sample);
/* The names of the columns, and a row for each point; period: [s] of a policy step. */
void track_print_header(FILE *csv);
void track_print(const Track *track, const char *ground, double speed, double period, FILE *csv);

/* What the ground did to the feet of every trial: a row for each foot after each physics step. */

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
