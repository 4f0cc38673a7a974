/* A press: a plate or a sole is moved through a ground along a prescribed path (down and up, in
 * cycles, forward), or dropped as a free body. The result is the force of the ground. */
#ifndef LAB_PRESS_H
#define LAB_PRESS_H

#include "mild/ground.h"

enum { PRESS_TURNS_MAX = 16 };

/* With material, speed and one turn, and all else 0, it goes down and up once. With mass > 0 a free
 * body is dropped. */
typedef struct {
    MildMaterial material;
    const MildMap *map; /* borrowed; NULL: level. Its height at the start is depth 0 */
    int print_tiles;    /* see mild_ground_bytes_prints */
    MildSolver solver;
    double tilt; /* [rad] about y, front edge down positive */
    double step; /* [s] time step; 0: a thousandth of the first way (0.02 mm with by_force), 1e-4
                    for a drop */

    double speed; /* [m/s] down and up */
    int turns;    /* down to the first, up to the second, and so on; after the last it leaves the
                  ground */
    double turn[PRESS_TURNS_MAX]; /* [m] depth of the reference point; with by_force [N] how hard
                                     the ground pushes */
    int by_force;                 /* bool */
    int cycles;                   /* how often all turns are made; 0 counts as 1 */
    double
        drag; /* [m] > 0: after the first way down it moves along +x at constant depth, then up */
    double drag_speed; /* [m/s] */

    double mass;    /* [kg] spread evenly over the sole */
    double height;  /* [m] of the lowest element above the ground at the start */
    double impact;  /* [m/s] downward at the start */
    double seconds; /* [s] recorded from the start */
} PressDef;

/* The reference point lies in the sole plane under the ankle; a plate's centre. Moments and the
 * zero moment point are about it, world axes. Depth is negative while it is still above the ground
 * (a tilted plate touches earlier). */
typedef struct {
    double time, depth, force, moment_x, moment_y, zmp_x, zmp_y; /* zmp NaN without force */
    double force_x, force_y, x, tilt;                            /* tilt [rad] */
    int contacts;
    int way; /* on a prescribed path: 0 is the first way down, each turn begins the next */
} PressRow;

typedef struct {
    PressRow *rows; /* [count], owned */
    int count, ways, room;
    double peak_force;        /* [N] */
    double work_in, work_out; /* [J] integral of the vertical force on the ways down and up */
    double work_drag;         /* [J] work of the motion along +x on the ground */
    double
        print_depth; /* [m] depth at which the force last vanished on a way up; 0 when it did not */
    double stop_depth, stop_time,
        rest_speed; /* [m, s, m/s] of a dropped body: first stop; speed at the end */
    int elements;
    double area; /* [m^2] of all elements */
} PressResult;

/* Force and depth of a row belong together: by hand the force at the row's depth (on virgin ground
 * the mean of the steps before and after, exact to second order; on the unloading line the step's
 * own, which is taken at its end); dropped the mean force of a step beside the depth and time of
 * its middle. Fails on a material out of range or a force that is not reached within PRESS_DEEPEST.
 * Close the result also after a failure. */
MildStatus press_run(const PressDef *def, const MildSole *sole, PressResult *result,
                     MildError *error);
void press_result_close(PressResult *result);

#define PRESS_DEEPEST 0.5 /* [m] a press to a force gives up here */

/* A rectangular sole of length x width at the paper's pitch, centred under its reference point. */
MildSole *press_plate_create(double length, double width, MildError *error);

#endif
