/* What plain steps seldom need, once for any number of loaded feet. */
#include "ground/newton_step.h"

#define NEWTON_HALVINGS 6     /* of a step that does not lower the residual */
#define NEWTON_NEAR 1e-5      /* [-] a residual below this share of the impulse may be rounding */
#define NEWTON_ROUNDING 6e-14 /* [-] rounding of V^ + A P: 256 units in the last place */
#define NEWTON_LENGTH 4e-16   /* [m] rounding of the elements' depths */

int rows_pivot(Row *M, int k, int n) {
    int pivot = k;
    for (int i = k + 1; i < n; i++) {
        if (fabs(M[i].at[k]) > fabs(M[pivot].at[k])) {
            pivot = i;
        }
    }
    Row row = M[k];
    M[k] = M[pivot];
    M[pivot] = row;
    return fabs(M[k].at[k]) > 0.0;
}

void point_halve(const System *system, MildScratch *scratch, const Point *at, Point *next, int n,
                 int parts) {
    const Point full = *next;
    double t = 1.0;
    for (int k = 0; k < NEWTON_HALVINGS; k++) {
        t *= 0.5;
        point_between(at, &full, t, next, n);
        point_evaluate(system, scratch, next, n, parts);
        if (next->residual < (1.0 - 0.1 * t) * at->residual) {
            return;
        }
    }
}

/* Bool: the step between two points is within the rounding error of V^ + A P and of the depths to
 * which dt V is added. */
static int step_is_rounding(const System *system, const Point *from, const Point *to, int n) {
    double size = 0.0;
    for (int i = 0; i < n; i++) {
        double sum = fabs(system->free.at[i]);
        for (int j = 0; j < n; j++) {
            sum += fabs(system->A[i].at[j] * from->impulse.at[j]);
        }
        size = fmax(size, sum);
    }
    double rounding = NEWTON_ROUNDING * size + NEWTON_LENGTH / system->dt;
    for (int i = 0; i < n; i++) {
        if (!(fabs(to->twist.at[i] - from->twist.at[i]) <= rounding)) { /* or not a number */
            return 0;
        }
    }
    return 1;
}

void point_correct(const System *system, MildScratch *scratch, Point *at, Point *next, int n,
                   int parts) {
    double scale = system_norm(system, at->impulse.at, n, parts);
    if (!(at->residual <= NEWTON_NEAR * scale + NEWTON_LENGTH)) {
        return;
    }
    Point corrected;
    contact_pass(scratch, system->dt, at->twist.at, system->first);
    if (!point_step(system, scratch, at, &corrected, 1, n, parts)) {
        return;
    }
    at->rests = step_is_rounding(system, at, &corrected, n);
    if (!at->rests) {
        point_evaluate(system, scratch, &corrected, n, parts);
        *next = corrected;
    }
}
