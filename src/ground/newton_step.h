/* Newton's method on the twists of the loaded feet: the equations and plain steps, for newton.c,
 * which compiles them for one loaded foot, for two and for more, and for newton_hard.c, which
 * compiles them once.
 *
 * There are n rows. Each uses `parts` vectors, the last of which also holds the right-hand side.
 * The other vectors of a row are neither read nor written. */
#ifndef MILD_GROUND_NEWTON_STEP_H
#define MILD_GROUND_NEWTON_STEP_H

#include <string.h>

#include "ground/pass.h"
#include "ground/solver.h"

#define NEWTON_GROWTH 8.0 /* [-] a larger elimination factor calls for a row exchange */

/* A row of up to 4 x 6 numbers and its right-hand side, padded to whole vectors. It uses the
 * compiler's vector type because loops over rows this short take three times as long when the
 * compiler vectorises them itself. */
enum { NEWTON_VECTOR = 8, NEWTON_VECTORS = 4, NEWTON_LANES = NEWTON_VECTOR * NEWTON_VECTORS };
typedef double Vector __attribute__((vector_size(NEWTON_VECTOR * sizeof(double))));
typedef union {
    double at[NEWTON_LANES];
    Vector part[NEWTON_VECTORS];
} Row;

_Static_assert(TWIST_MAX < NEWTON_LANES, "a row holds all feet and a right-hand side");

/* The equations of the loaded feet. The lanes of a row beyond the last foot are zero. */
typedef struct {
    Row A[TWIST_MAX]; /* [1/kg, 1/(kg m), 1/(kg m^2)] inverse inertia, symmetric */
    Row free;         /* V^ [m/s, rad/s] twists of the free motion */
    double tolerance; /* [-] of the residual */
    double dt;        /* [s] */
    int limit;        /* Newton steps in all */
    int first;        /* row of the first loaded foot in the step's arrays */
} System;

/* One point of the search: impulse P, foot twists V = V^ + A P. */
typedef struct {
    Row impulse;     /* P [N s, N m s] */
    Row twist;       /* V [m/s, rad/s] */
    double residual; /* norm of P - W(V) in the metric of kinetic energy */
    int rests;       /* bool: Newton's step from here is no longer than rounding */
} Point;

MILD_HD void row_clear(Row *row, int parts) {
    for (int p = 0; p < parts; p++) {
        row->part[p] = (Vector){0.0};
    }
}

/* Sets the first n numbers of a row and clears the rest. */
MILD_HD void row_load(Row *row, const double *values, int n, int parts) {
    row_clear(row, parts);
    memcpy(row->at, values, (size_t)n * sizeof *values);
}

MILD_HD void row_copy(Row *to, const Row *from, int parts) {
    for (int p = 0; p < parts; p++) {
        to->part[p] = from->part[p];
    }
}

MILD_HD void point_copy(Point *to, const Point *from, int parts) {
    row_copy(&to->impulse, &from->impulse, parts);
    row_copy(&to->twist, &from->twist, parts);
    to->residual = from->residual;
    to->rests = from->rests;
}

/* Row i of a unit matrix, from a window over one 1 among zeros: a 1 stored into a cleared row would
 * delay the load of its vector. */
MILD_HD void row_unit(Row *row, int i, int parts) {
    static const double window[2 * NEWTON_LANES] = {[NEWTON_LANES] = 1.0};
    memcpy(row->part, window + NEWTON_LANES - i, (size_t)parts * sizeof row->part[0]);
}

/* y += A x; A is symmetric. */
MILD_HD void system_times(const System *system, const double *x, Row *y, int n, int parts) {
    for (int j = 0; j < n; j++) {
        for (int p = 0; p < parts; p++) {
            y->part[p] += x[j] * system->A[j].part[p];
        }
    }
}

/* sqrt(x^T A x), the norm of an impulse in the metric of kinetic energy. */
MILD_HD double system_norm(const System *system, const double *x, int n, int parts) {
    Row y;
    double sum = 0.0;
    row_clear(&y, parts);
    system_times(system, x, &y, n, parts);
    for (int i = 0; i < n; i++) {
        /* row_clear has set these: n numbers are in `parts` parts */
        /* NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult) */
        sum += x[i] * y.at[i];
    }
    return sqrt(fmax(sum, 0.0));
}

MILD_HD void point_evaluate(const System *system, MildScratch *scratch, Point *point, int n,
                            int parts) {
    double apart[TWIST_MAX];
    contact_pass(scratch, system->dt, point->twist.at, system->first);
    for (int i = 0; i < n; i++) {
        apart[i] = point->impulse.at[i] - scratch->wrench[system->first + i];
    }
    point->residual = system_norm(system, apart, n, parts);
}

/* Row exchange of the elimination: swaps row k with the row at or below it that has the largest
 * number in column k. Returns false when that number is zero. */
int rows_pivot(Row *M, int k, int n);

/* Solves M x = right by Gaussian elimination. The right-hand side is column n of the rows. The
 * diagonal serves as the pivot unless a factor exceeds NEWTON_GROWTH. */
MILD_HD int rows_eliminate(Row *M, double *x, int n, int parts) {
    double inverse[TWIST_MAX];
    for (int k = 0; k < n; k++) {
        double grown = 0.0, own = 1.0 / M[k].at[k];
        for (int i = k + 1; i < n; i++) {
            grown += fabs(M[i].at[k] * own) <= NEWTON_GROWTH ? 0.0 : 1.0;
        }
        if (grown > 0.0) {
            if (!rows_pivot(M, k, n)) {
                return 0;
            }
            own = 1.0 / M[k].at[k];
        }
        inverse[k] = own;
        for (int i = k + 1; i < n; i++) {
            double factor = M[i].at[k] * own;
            for (int p = 0; p < parts; p++) {
                M[i].part[p] -= factor * M[k].part[p];
            }
        }
    }
    for (int i = 0; i < n; i++) {
        x[i] = M[i].at[n];
    }
    for (int j = n - 1; j >= 0; j--) {
        x[j] *= inverse[j];
        for (int i = 0; i < j; i++) {
            x[i] -= M[i].at[j] * x[j];
        }
    }
    return 1;
}

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
MILD_HD int point_step(const System *system, MildScratch *scratch, const Point *at, Point *next,
                       int correct, int n, int parts) {
    Row M[TWIST_MAX];
    Row last;
    double moved[TWIST_MAX];
    row_unit(&last, n, parts);
    contact_hessian(scratch);
    for (int k = 0; k < n; k++) {
        moved[k] = correct ? 0.0 : at->twist.at[k] - system->free.at[k];
    }
    for (int i = 0; i < n; i++) {
        int foot = i / 6 * 6;
        const double *H = scratch->hessian[(system->first + foot) / 6] + 6 * (i - foot);
        double right = scratch->wrench[system->first + i] - (correct ? at->impulse.at[i] : 0.0);
        Row row;
        row_unit(&row, i, parts);
        for (int k = 0; k < 6; k++) {
            /* NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult): n is in sixes */
            right += H[k] * moved[foot + k];
            for (int p = 0; p < parts; p++) {
                row.part[p] += H[k] * system->A[foot + k].part[p];
            }
        }
        for (int p = 0; p < parts; p++) {
            M[i].part[p] = row.part[p] + right * last.part[p];
        }
    }
    next->rests = 0;
    row_clear(&next->impulse, parts);
    if (!rows_eliminate(M, next->impulse.at, n, parts)) {
        return 0;
    }
    row_copy(&next->twist, correct ? &at->twist : &system->free, parts);
    system_times(system, next->impulse.at, &next->twist, n, parts);
    for (int i = 0; correct && i < n; i++) {
        next->impulse.at[i] += at->impulse.at[i];
    }
    return 1;
}

MILD_HD void point_between(const Point *from, const Point *to, double t, Point *point, int n) {
    for (int i = 0; i < n; i++) {
        point->impulse.at[i] = from->impulse.at[i] + t * (to->impulse.at[i] - from->impulse.at[i]);
        point->twist.at[i] = from->twist.at[i] + t * (to->twist.at[i] - from->twist.at[i]);
    }
}

/* Halves the step until the residual falls. If it never does, keeps the shortest step, which may
 * lead across a kink of the law. */
void point_halve(const System *system, MildScratch *scratch, const Point *at, Point *next, int n,
                 int parts);
/* The step from `at` to `next` did not lower the residual. Near the solution the reason may be
 * rounding, so repeat the step as a correction. If the correction is itself within rounding, `at`
 * is the solution. */
void point_correct(const System *system, MildScratch *scratch, Point *at, Point *next, int n,
                   int parts);

MILD_HD int point_solves(const System *system, const Point *point, int n, int parts) {
    return point->rests ||
           point->residual <= system->tolerance * system_norm(system, point->impulse.at, n, parts);
}

/* Plain Newton steps from `best`, at which the last pass was made. Leaves the best point seen in
 * `best`. Returns the number of steps. */
MILD_HD int newton_plain(const System *system, MildScratch *scratch, Point *best, int limit, int n,
                         int parts) {
    Point at, next;
    int steps = 0, solved = 0;
    point_copy(&at, best, parts);
    while (!solved && steps < limit && point_step(system, scratch, &at, &next, 0, n, parts)) {
        steps++;
        point_evaluate(system, scratch, &next, n, parts);
        if (!(next.residual < at.residual)) {
            point_correct(system, scratch, &at, &next, n, parts);
        }
        if (at.rests) {
            point_copy(best, &at, parts);
            break;
        }
        if (!(next.residual < at.residual)) {
            point_halve(system, scratch, &at, &next, n, parts);
        }
        point_copy(&at, &next, parts);
        solved = point_solves(system, &at, n, parts);
        if (solved || at.residual < best->residual) {
            point_copy(best, &at, parts);
        }
    }
    return steps;
}

#endif
