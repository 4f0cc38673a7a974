/* The laboratory's press: a plate or the robot's sole moved through a ground by hand (down and up,
 * in cycles, sideways), or dropped as a free body, and what the ground answers. */
#ifndef LAB_PRESS_H
#define LAB_PRESS_H

#include "mild/ground.h"

enum { PRESS_TURNS_MAX = 16 };

/* All zero but material, speed and one turn: once down and up. A body is dropped when `mass` is
 * above 0. */
typedef struct {
    MildMaterial material;
    const MildMap *map; /* borrowed; NULL: level. Its height at the start is depth 0 */
    int print_tiles;    /* see mild_ground_bytes_prints */
    MildSolver solver;
    double tilt; /* [rad] about y, front edge down positive */
    double step; /* [s] 0: a thousandth of the first way by hand (0.02 mm with by_force), 1e-4
                    dropped */

    double speed; /* [m/s] down and up */
    int turns; /* down to the first, up to the second, down to the third ...; after the last above
                  the ground */
    double turn[PRESS_TURNS_MAX]; /* [m] depth of the reference point; with by_force [N] how hard
                                     the ground pushes */
    int by_force;                 /* bool */
    int cycles;                   /* how often through all turns; 0 counts as 1 */
    double drag;       /* [m] > 0: after the first way down along +x at constant depth, then up */
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
    int way; /* by hand: 0 is the first way down, each turn begins the next */
} PressRow;

typedef struct {
    PressRow *rows; /* [count], owned */
    int count, ways, room;
    double peak_force;        /* [N] */
    double work_in, work_out; /* [J] vertical force times way, down and up */
    double work_drag;         /* [J] taken by the ground from the motion sideways */
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
