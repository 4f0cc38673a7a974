/* Private to the plugin: MuJoCo's constraints while the ground is solved.
 *
 * The force of a row is a function of x = J a - aref, where a is the acceleration that its solver
 * finds, in zones in each of which it is linear:
 *
 *     equality                  f = -D x
 *     friction loss             f = -D x, at most the loss
 *     limit, pyramid of contact f = max(0, -D x)
 *
 * While the zones stay,
 *
 *     K a = f + J_c^T (D aref + constant forces) + J^T W,   K = M + J_c^T D J_c,
 *
 * with the M of the solver, so that a is linear in the wrench W of the ground. The ground is solved
 * with that. If a is then in other zones, a part of the way to it is gone (rows_move), and the next
 * ones are tried: Newton's method for the sum of kinetic energy, constraints and ground. */
#ifndef PLUGIN_ROWS_H
#define PLUGIN_ROWS_H

#include "plugin/metric.h"

typedef struct {
    int count;         /* of rows */
    int room;          /* for rows */
    int *zone;         /* [count] of the force: 0 constant and 0, 1 linear, 2 and 3 at a bound */
    double *stiffness; /* [count] D in the zone 1, else 0 */
    double *x;         /* [count] J a - aref */
    double *change;    /* [count] J times a step of a */
    double *a;         /* [dofs] acceleration */
    double *trial;     /* [dofs] that of rows_solve */
    double *force;     /* [dofs] without ground and constraints */
    double *load;      /* [dofs] force, with what the zones add that does not depend on a */
    double *push;      /* [dofs] J^T W */
} Rows;

/* Bool: the rows are of the kinds above, and not cones of contacts. */
int rows_are_simple(const mjData *d);
/* Returns 0 when out of memory; free with rows_free. */
int rows_alloc(Rows *rows, const mjModel *m);
void rows_free(Rows *rows);
/* Starts at the acceleration of the last step. Allocates only for more rows than ever before, and
 * returns 0 when that fails. */
int rows_start(Rows *rows, const Metric *metric, const mjModel *m, const mjData *d);
/* Takes over the zones of a. */
void rows_enter(Rows *rows, const Metric *metric, const mjModel *m, const mjData *d);
/* trial = K^-1 (load + push), with metric->held. */
void rows_solve(Rows *rows, const Metric *metric);
/* Bool: trial is in the zones that it was computed with. */
int rows_stay(const Rows *rows, const Metric *metric, const mjModel *m, const mjData *d);
/* Goes from a towards trial, to the least sum of energies on the way. */
void rows_move(Rows *rows, const Metric *metric, const mjModel *m, const mjData *d);

#endif
