/* Private to the plugin: Anderson's acceleration of a fixed-point iteration x <- x + c(x) (Anderson
 * 1965). Of all combinations of the last few steps it takes the one whose change c would be
 * smallest if c were linear. */
#ifndef PLUGIN_MIX_H
#define PLUGIN_MIX_H

#include "mild/ground.h"

#define MIX_DEPTH 4                  /* steps remembered */
#define MIX_ROWS (6 * MILD_FEET_MAX) /* most numbers in x */

typedef struct {
    int rows;  /* in use */
    int known; /* bool: x and c are those of the last call */
    int steps; /* remembered */
    double x[MIX_ROWS];
    double c[MIX_ROWS];
    double dx[MIX_DEPTH][MIX_ROWS]; /* differences between successive calls */
    double dc[MIX_DEPTH][MIX_ROWS];
} Mix;

/* Forgets everything. */
void mix_start(Mix *mix, int rows);
/* Replaces x by the next one to try. c: [rows] change of x at x. */
void mix_next(Mix *mix, double *x, const double *c);

/* Newton's step in the place of mix_next, where the ground's response is known: it solves with
 *
 *     V = x + A P,    MuJoCo steps to V' = V_0 + E P,    P = P_0 - H V
 *
 * for V = V', with P the impulse of the ground and H = -dP/dV. From a change c = V' - V that is
 *
 *     x <- x + (1 + A H) (1 + E H)^-1 c
 *
 * A, E, H: [rows][rows]. Returns 0, with x as it was, when the matrix is singular. */
int mix_newton(const Mix *mix, const double *A, const double *E, const double *H, const double *c,
               double *x);

#endif
