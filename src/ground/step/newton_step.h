/* Newton's method on the twists of the loaded feet: the equations and plain steps, for newton.c and
 * newton_hard.c. One code serves any number of feet. */
#ifndef MILD_GROUND_NEWTON_STEP_H
#define MILD_GROUND_NEWTON_STEP_H

#include <string.h>

#include "ground/step/step.h"

/* A row of six numbers for each foot and its right-hand side, padded to whole vectors. It uses the
 * compiler's vector type because loops over rows this short take three times as long when the
 * compiler vectorises them itself. A vector is as wide as the processor's: of a wider type gcc
 * makes loads and stores of parts, which takes up to four times as long. */
#if defined(__AVX512F__)
enum { NEWTON_VECTOR = 8 };
#elif defined(__AVX__)
enum { NEWTON_VECTOR = 4 };
#else
enum { NEWTON_VECTOR = 2 };
#endif
enum { NEWTON_LANES = ROW_LANES, NEWTON_VECTORS = NEWTON_LANES / NEWTON_VECTOR };
typedef double Vector __attribute__((vector_size(NEWTON_VECTOR * sizeof(double))));
typedef union {
    double at[NEWTON_LANES];
    Vector part[NEWTON_VECTORS];
} Row;

_Static_assert(TWIST_MAX % 8 == 0, "whole vectors, the last for the right-hand side");

/* The equations of the listed feet, in the order of scratch->list. The lanes of a row beyond the
 * last foot are zero. */
typedef struct {
    Vector *A;        /* [n][parts] [1/kg, 1/(kg m), 1/(kg m^2)] inverse inertia, symmetric */
    Vector *M;        /* [n][parts] of point_step */
    Row free;         /* V^ [m/s, rad/s] twists of the free motion */
    double tolerance; /* [-] of the residual */
    double dt;        /* [s] */
    int limit;        /* Newton steps in all */
    int n;            /* rows, six for each foot */
    int parts;        /* vectors of a row that are in use; the last also has the right-hand side */
} System;

/* One point of the search: impulse P, foot twists V = V^ + A P. */
typedef struct {
    Row impulse;     /* P [N s, N m s] */
    Row twist;       /* V [m/s, rad/s] */
    double residual; /* norm of P - W(V) in the metric of kinetic energy */
    int rests;       /* bool: Newton's step from here is no longer than rounding */
} Point;

/* Clears the parts of a row that are in use. */
void row_clear(const System *system, Row *row);
/* Row r of the system's arrays is row listed_row(scratch, r) of those of all feet. */
static inline int listed_row(const MildScratch *scratch, int r) {
    return 6 * scratch->list[r / 6] + r % 6;
}
/* y += A x; A is symmetric. */
void system_times(const System *system, const double *x, Row *y);
/* sqrt(x^T A x), the norm of an impulse in the metric of kinetic energy. */
double system_norm(const System *system, const double *x);

/* Makes a pass at the point's twist, for its residual. */
void point_evaluate(const System *system, MildScratch *scratch, Point *point);
/* One Newton step. With H = -dW/dV, the linearised law of the last pass at V is W + H (V - V^ - A
 * P) = P, so
 *
 *     (1 + H A) P = W + H (V - V^)
 *
 * With `correct`, solve for the change of P instead:
 *
 *     (1 + H A) dP = W - P
 *
 * V then moves by A dP, and the rounding error is proportional to dP rather than to P. Returns
 * false when the matrix is singular. */
int point_step(const System *system, MildScratch *scratch, const Point *at, Point *next,
               int correct);
/* The point at the share t of the way between two. */
void point_between(const System *system, const Point *from, const Point *to, double t,
                   Point *point);
/* Halves the step until the residual falls. If it never does, keeps the shortest step, which may
 * lead across a kink of the law. */
void point_halve(const System *system, MildScratch *scratch, const Point *at, Point *next);
/* The step from `at` to `next` did not lower the residual. Near the solution the reason may be
 * rounding, so repeat the step as a correction. If the correction is itself within rounding, `at`
 * is the solution. */
void point_correct(const System *system, MildScratch *scratch, Point *at, Point *next);
/* Bool: the residual is within the tolerance, or as small as rounding lets it be. */
int point_solves(const System *system, const Point *point);

/* Plain Newton steps from `best`, at which the last pass was made. Leaves the best point seen in
 * `best`. Returns the number of steps. */
int newton_plain(const System *system, MildScratch *scratch, Point *best, int limit);

/* ---- newton_hard.c: steps that plain steps do not solve ---- */

/* For steps on which plain Newton diverges because the bounds depend on I_z, or cycles over kinks
 * of the law. Alternate: minimise with the friction bounds fixed, move the bounds towards those at
 * the minimum, and try plain steps from there. Every BOUNDS_PATIENCE rounds, restart from bounds
 * several times as wide. Returns the number of steps. */
int newton_patient(const System *system, MildScratch *scratch, Point *best, int limit);
/* Chooses what to return for a step that the search has left unsolved. Its best point may be far
 * from a solution even with a small residual: its impulses may be zero deep in the ground. The
 * alternative is a minimum at fixed friction bounds, taken from the normal impulses without
 * friction. There every normal impulse obeys the law at the new velocity, and only the friction
 * bound does not. Returns the candidate closer to the law in `scratch` and `result`, and the number
 * of steps as the value. */
int newton_unsolved(const System *system, MildScratch *scratch, const Point *best,
                    MildContactResult *result);

#endif
