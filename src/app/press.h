/* A plate or the sole pushed into a ground along a prescribed path, and drawn out again: the numbers a press gives. */
#ifndef MILD_PRESS_H
#define MILD_PRESS_H

#include "mild/ground.h"

typedef struct {
    MildMaterial material;
    double depth; /* [m] of the reference point at the turn */
    double speed; /* [m/s] down, then up */
    double tilt;  /* [rad] about y, nose down positive */
    MildSolver solver;
} PressDef;

/* The reference point lies in the sole plane under the ankle; a plate's centre. Moments and the zero moment point are
 * about it, world axes. Depth is negative while it is still above the ground (a tilted plate touches earlier). */
typedef struct {
    double time, depth, force, moment_x, moment_y, zmp_x, zmp_y; /* zmp NaN without force */
    int contacts;
} PressRow;

enum { PRESS_STEPS = 1000, PRESS_ROWS = 2 * PRESS_STEPS + 1 }; /* rows 0 .. PRESS_STEPS go down, the rest up */

typedef struct {
    PressRow rows[PRESS_ROWS];
    double peak_force;        /* [N] */
    double work_in, work_out; /* [J] force times way, down and up */
    double print_depth;       /* [m] depth at which the force had vanished on the way up */
    int elements;
    double area; /* [m^2] of all elements */
} PressResult;

/* Runs on a sole of any outline; NULL result fields are not allowed. */
MildStatus press_run(const PressDef *def, const MildSole *sole, PressResult *result, MildError *error);

/* A rectangular sole of length x width at the paper's pitch, centred under its reference point. */
MildSole *press_plate_create(double length, double width, MildError *error);

#endif
