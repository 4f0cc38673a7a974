/* A press: a plate or a sole is moved through a ground along a prescribed path (down and up, in
 * cycles, forward), or dropped as a free body. The result is the force of the ground. */
#ifndef LAB_PRESS_H
#define LAB_PRESS_H

#include "mild/ground.h"

enum { PRESS_TURNS_MAX = 16 };

/* What to press. With material, speed and one turn, and everything else 0, the sole goes down and
 * up once. With mass > 0 a free body is dropped. */
typedef struct {
    MildMaterial material;
    const MildMap *map; /* borrowed; NULL: level. Its height at the start has depth 0 */
    int imprint_tiles;  /* see mild_ground_bytes_imprints */
    MildSolver solver;
    double tilt; /* [rad] about y, front edge down positive */
    double step; /* [s] time step; 0: a thousandth of the first way (0.02 mm with by_force), 1e-4
                    for a drop */

    double speed; /* [m/s] down and up */
    int turns;    /* number of turning points: down to the first, up to the second, and so on; after
                     the last the sole leaves the ground */
    double turn[PRESS_TURNS_MAX]; /* [m] depth of the reference point, or with by_force [N] force of
                                     the ground */
    int by_force;                 /* bool: turn at forces instead of depths */
    int cycles;                   /* how often all turns are made; 0 counts as 1 */
    double drag;                  /* [m] if > 0: move this far along +x after the first way down, at
                                     constant depth, then up */
    double drag_speed;            /* [m/s] */

    double mass;    /* [kg] spread evenly over the sole */
    double height;  /* [m] of the lowest element above the ground at the start */
    double impact;  /* [m/s] downward at the start */
    double seconds; /* [s] recorded from the start */
} PressDef;

/* One row of a record. The reference point lies in the sole plane under the ankle; for a plate it
 * is the centre. Moments and the zero moment point refer to it, in world axes. Depth is negative
 * while the point is above the ground, which a tilted plate may touch earlier. */
typedef struct {
    double time;     /* [s] */
    double depth;    /* [m] of the reference point */
    double force;    /* [N] up, on the sole */
    double moment_x; /* [N m] */
    double moment_y; /* [N m] */
    double zmp_x;    /* [m] NaN without force */
    double zmp_y;    /* [m] NaN without force */
    double force_x;  /* [N] */
    double force_y;  /* [N] */
    double x;        /* [m] of the reference point */
    double tilt;     /* [rad] */
    int contacts;    /* number of loaded elements */
    int way;         /* on a prescribed path: 0 is the first way down, each turn begins the next */
} PressRow;

typedef struct {
    PressRow *rows;     /* [count], owned */
    int count;          /* number of rows */
    int ways;           /* ways of a prescribed path */
    int room;           /* rows that fit before `rows` must grow */
    double peak_force;  /* [N] */
    double work_in;     /* [J] integral of the vertical force on the ways down */
    double work_out;    /* [J] the same on the ways up */
    double work_drag;   /* [J] work of the motion along +x on the ground */
    double print_depth; /* [m] where the force last vanished on a way up; 0 if it never did */
    double stop_depth;  /* [m] dropped body: depth of the first stop */
    double stop_time;   /* [s] dropped body: time of the first stop */
    double rest_speed;  /* [m/s] dropped body: speed at the end */
    int elements;       /* number of elements */
    double area;        /* [m^2] of all elements */
} PressResult;

/* Runs a press. Each row gives the force at its own depth. On a prescribed path this is the force
 * at the end of the step. For a dropped body it is the mean force of a step, with the time and
 * depth of the middle of that mean. Fails when a material is out of range or a force is not reached
 * within PRESS_DEEPEST. Close the result even after a failure. */
MildStatus press_run(const PressDef *def, const MildSole *sole, PressResult *result,
                     MildError *error);
void press_result_close(PressResult *result);

#define PRESS_DEEPEST 0.5 /* [m] a press to a force gives up here */

/* A rectangular sole of length x width at the paper's pitch, centred under its reference point. */
MildSole *press_plate_create(double length, double width, MildError *error);
/* A round one, and its area [m^2], which the elements have only about. */
MildSole *press_disc_create(double diameter, MildError *error);
double press_disc_area(double diameter);

#endif
