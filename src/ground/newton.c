#include <string.h>

#include "ground/pass.h"
#include "ground/solver.h"

#define NEWTON_TOLERANCE 1e-9
#define NEWTON_ITERATIONS 400 /* hard bound of work */
#define NEWTON_PLAIN 20       /* of them without held bounds */
#define NEWTON_ROUND 20       /* with the bounds held once */
#define NEWTON_TRY 6          /* plain ones after each round */
#define NEWTON_HALVINGS 6
#define NEWTON_SEARCH 30 /* bisections along a step */
#define NEWTON_GROWTH                                                                              \
    8.0 /* an elimination's factors beyond this are worth a search for a pivot   \
                           */
/* A row of up to 4 x 6 numbers and a right side, in whole vectors. Written with the compiler's vector type: what it
 * makes of plain loops over so short rows takes three times as long. */
enum { NEWTON_VECTOR = 8, NEWTON_VECTORS = 4, NEWTON_LANES = NEWTON_VECTOR * NEWTON_VECTORS };
typedef double Vector __attribute__((vector_size(NEWTON_VECTOR * sizeof(double))));
typedef union {
    double at[NEWTON_LANES];
    Vector part[NEWTON_VECTORS];
} Row;

_Static_assert(TWIST_MAX < NEWTON_LANES, "a row holds all feet and a right side");

/* The loaded feet's rows of the problem: `first` is the row of the first one; what lies beyond the
 * last is zero. */
typedef struct {
    Row A[TWIST_MAX], free;
    double tolerance, dt;
    int limit, first;
} System;

/* One point of the search: impulse P, foot twists V = V^ + A P. */
typedef struct {
    Row impulse, twist;
    double residual;
} Point;

static void system_open(System *system, const MildScratch *scratch, const MildContactInput *input,
                        int first, int n) {
    int stride = 6 * scratch->feet;
    system->first = first;
    system->free = (Row){{0.0}};
    for (int i = 0; i < n; i++) {
        system->A[i] = (Row){{0.0}};
        memcpy(system->A[i].at, input->inverse_inertia + (first + i) * stride + first,
               (size_t)n * sizeof(double));
    }
    memcpy(system->free.at, input->free_velocity + first, (size_t)n * sizeof(double));
    system->tolerance = input->tolerance > 0.0 ? input->tolerance : NEWTON_TOLERANCE;
    system->limit = input->max_iterations > 0 ? input->max_iterations : NEWTON_ITERATIONS;
    system->dt = input->dt;
}

static int least(int a, int b) {
    return a < b ? a : b;
}

/* All that follows is compiled for one and for two loaded feet, and for more: n rows in `parts`
 * vectors, of which the last holds the right side, too. */

/* y += A x; A is symmetric. */
ALWAYS_INLINE void system_times(const System *system, const double *x, Row *y, int n, int parts) {
    for (int j = 0; j < n; j++) {
        for (int p = 0; p < parts; p++) {
            y->part[p] += x[j] * system->A[j].part[p];
        }
    }
}

/* sqrt(x^T A x): in the metric of kinetic energy. */
ALWAYS_INLINE double system_norm(const System *system, const double *x, int n, int parts) {
    Row y = {{0.0}};
    double sum = 0.0;
    system_times(system, x, &y, n, parts);
    for (int i = 0; i < n; i++) {
        sum += x[i] * y.at[i];
    }
    return sqrt(fmax(sum, 0.0));
}

ALWAYS_INLINE void point_evaluate(const System *system, MildScratch *scratch, Point *point, int n,
                                  int parts) {
    double apart[TWIST_MAX];
    contact_pass(scratch, system->dt, point->twist.at, system->first);
    for (int i = 0; i < n; i++) {
        apart[i] = point->impulse.at[i] - scratch->wrench[system->first + i];
    }
    point->residual = system_norm(system, apart, n, parts);
}

/* The row at or below k with the largest number in column k; 0 when there is none. */
static int rows_pivot(Row *M, int k, int n) {
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

/* Gaussian elimination of the rows [M | right side], the right side in column n; x = M^-1 right.
 * The diagonal is the pivot unless a factor grows. */
ALWAYS_INLINE int rows_eliminate(Row *M, double *x, int n, int parts) {
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

/* The law of the last pass, at V, linearised with H = -dW/dV: W + H (V - V^ - A P) = P, that is (1
 * + H A) P = W + H (V - V^). */
ALWAYS_INLINE int point_newton(const System *system, MildScratch *scratch, const Point *at,
                               Point *next, int n, int parts) {
    static const Row unit[TWIST_MAX + 1] = {
        {{1}},        {{0, 1}},     {{[2] = 1}},  {{[3] = 1}},  {{[4] = 1}},
        {{[5] = 1}},  {{[6] = 1}},  {{[7] = 1}},  {{[8] = 1}},  {{[9] = 1}},
        {{[10] = 1}}, {{[11] = 1}}, {{[12] = 1}}, {{[13] = 1}}, {{[14] = 1}},
        {{[15] = 1}}, {{[16] = 1}}, {{[17] = 1}}, {{[18] = 1}}, {{[19] = 1}},
        {{[20] = 1}}, {{[21] = 1}}, {{[22] = 1}}, {{[23] = 1}}, {{[24] = 1}}};
    Row M[TWIST_MAX];
    double moved[TWIST_MAX];
    contact_hessian(scratch);
    for (int k = 0; k < n; k++) {
        moved[k] = at->twist.at[k] - system->free.at[k];
    }
    for (int i = 0; i < n; i++) {
        int foot = i / 6 * 6;
        const double *H = scratch->hessian[(system->first + foot) / 6] + 6 * (i - foot);
        double right = scratch->wrench[system->first + i];
        Row row = unit[i];
        for (int k = 0; k < 6; k++) {
            right += H[k] * moved[foot + k];
            for (int p = 0; p < parts; p++) {
                row.part[p] += H[k] * system->A[foot + k].part[p];
            }
        }
        for (int p = 0; p < parts; p++) {
            M[i].part[p] = row.part[p] + right * unit[n].part[p];
        }
    }
    memset(next, 0, sizeof *next);
    if (!rows_eliminate(M, next->impulse.at, n, parts)) {
        return 0;
    }
    next->twist = system->free;
    system_times(system, next->impulse.at, &next->twist, n, parts);
    return 1;
}

ALWAYS_INLINE void point_between(const Point *from, const Point *to, double t, Point *point,
                                 int n) {
    for (int i = 0; i < n; i++) {
        point->impulse.at[i] = from->impulse.at[i] + t * (to->impulse.at[i] - from->impulse.at[i]);
        point->twist.at[i] = from->twist.at[i] + t * (to->twist.at[i] - from->twist.at[i]);
    }
}

/* Halves the step until the residual falls. In vain, the shortest stands: it may lead over a kink
 * of the law. */
ALWAYS_INLINE void point_halve(const System *system, MildScratch *scratch, const Point *at,
                               Point *next, int n, int parts) {
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

ALWAYS_INLINE int point_solves(const System *system, const Point *point, int n, int parts) {
    return point->residual <= system->tolerance * system_norm(system, point->impulse.at, n, parts);
}

/* Newton's method from the best point so far, whose pass has been made; leaves there the best that
 * it has seen. Returns the steps done. */
ALWAYS_INLINE int newton_plain(const System *system, MildScratch *scratch, Point *best, int limit,
                               int n, int parts) {
    Point at = *best, next;
    int steps = 0, solved = 0;
    while (!solved && steps < limit && point_newton(system, scratch, &at, &next, n, parts)) {
        steps++;
        point_evaluate(system, scratch, &next, n, parts);
        if (!(next.residual < at.residual)) {
            point_halve(system, scratch, &at, &next, n, parts);
        }
        at = next;
        solved = point_solves(system, &at, n, parts);
        if (solved || at.residual < best->residual) {
            *best = at;
        }
    }
    return steps;
}

/* Slope along the step between two points of the function that held bounds make, at a point whose
 * pass was the last: (P - W)^T A dP. */
static double step_slope(const System *system, const MildScratch *scratch, const Point *at,
                         const Point *from, const Point *to, int n) {
    double slope = 0.0;
    for (int i = 0; i < n; i++) {
        slope += (at->impulse.at[i] - scratch->wrench[system->first + i]) *
                 (to->twist.at[i] - from->twist.at[i]);
    }
    return slope;
}

/* With the bounds of friction held the step is the minimum of a convex function, and a search along
 * each step finds it from anywhere. */
static int newton_held(const System *system, MildScratch *scratch, Point *at, int limit, int n,
                       int parts) {
    int steps = 0, moves = 1;
    Point full, next;
    contact_pass_held(scratch, system->dt, at->twist.at, system->first);
    while (moves && steps < limit && point_newton(system, scratch, at, &full, n, parts)) {
        steps++;
        double start = step_slope(system, scratch, at, at, &full, n), end, low = 0.0, high = 1.0,
               t = 1.0;
        for (int k = 0; k <= NEWTON_SEARCH; k++) {
            point_between(at, &full, t, &next, n);
            contact_pass_held(scratch, system->dt, next.twist.at, system->first);
            end = step_slope(system, scratch, &next, at, &full, n);
            if (!(fabs(end) > 0.1 * fabs(start)) || (end < 0.0 && t == 1.0)) {
                break;
            }
            *(end < 0.0 ? &low : &high) = t;
            t = 0.5 * (low + high);
        }
        double moved[TWIST_MAX], scale = system_norm(system, next.impulse.at, n, parts);
        for (int i = 0; i < n; i++) {
            moved[i] = next.impulse.at[i] - at->impulse.at[i];
        }
        *at = next;
        moves = !(system_norm(system, moved, n, parts) <= 0.1 * system->tolerance * scale);
    }
    return steps;
}

/* Where the bounds' dependence on I_z leads Newton's method astray, or it runs in circles over
 * kinks: minimum at held bounds and bounds at the minimum follow each other, with shorter steps
 * when they do not come closer. */
static int newton_patient(const System *system, MildScratch *scratch, Point *best, int limit, int n,
                          int parts) {
    Point at = *best;
    int steps = 0;
    double share = 1.0, last = INFINITY;
    if (isinf(at.residual)) {
        at.twist = system->free; /* without an impulse */
    }
    contact_pass(scratch, system->dt, at.twist.at, system->first);
    contact_bounds(scratch, 1.0);
    for (int round = 1; steps < limit && !point_solves(system, best, n, parts); round++) {
        int held = newton_held(system, scratch, &at, least(limit - steps, NEWTON_ROUND), n, parts);
        if (held == 0) {
            break; /* the numbers have gone bad */
        }
        steps += held;
        point_evaluate(system, scratch, &at, n, parts);
        contact_bounds(scratch, share);
        Point tried = at;
        steps += newton_plain(system, scratch, &tried, least(limit - steps, NEWTON_TRY), n, parts);
        if (tried.residual < best->residual) {
            *best = tried;
        }
        if (round % 4 > 0) {
            continue;
        }
        if (at.residual > 0.5 * last) {
            share = fmax(0.5 * share, 0.02);
        }
        last = at.residual;
    }
    return steps;
}

ALWAYS_INLINE void system_solve(const System *system, MildScratch *scratch, const double *start,
                                MildContactResult *result, int n, int parts) {
    Point best = {.residual = INFINITY};
    memcpy(best.twist.at, start, (size_t)n * sizeof(double));
    contact_pass(scratch, system->dt, best.twist.at, system->first);
    int steps = newton_plain(system, scratch, &best, least(system->limit, NEWTON_PLAIN), n, parts);
    if (!point_solves(system, &best, n, parts)) {
        steps += newton_patient(system, scratch, &best, system->limit - steps, n, parts);
        contact_pass(scratch, system->dt, best.twist.at, system->first);
    }
    double scale = system_norm(system, best.impulse.at, n, parts);
    result->iterations = steps;
    result->residual = scale > 0.0 ? best.residual / scale : best.residual;
    result->converged = best.residual <= system->tolerance * scale;
}

void newton_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result) {
    int stride = 6 * scratch->feet, first = 0, end = scratch->feet;
    while (scratch->foot[first].active == 0) {
        first++;
    }
    while (scratch->foot[end - 1].active == 0) {
        end--;
    }
    int n = 6 * (end - first);
    System system;
    memset(scratch->wrench, 0, sizeof scratch->wrench);
    system_open(&system, scratch, input, 6 * first, n);
    for (int f = first; f < end && n > 12; f++) { /* a foot in the air between loaded ones */
        if (scratch->foot[f].active == 0) {
            memset(scratch->hessian[f], 0, sizeof scratch->hessian[f]);
        }
    }
    if (n == 6) {
        system_solve(&system, scratch, input->velocity[first], result, 6, 1);
    } else if (n == 12) {
        system_solve(&system, scratch, input->velocity[first], result, 12, 2);
    } else {
        system_solve(&system, scratch, input->velocity[first], result, n, NEWTON_VECTORS);
    }
    for (int i = 0; i < stride; i++) {
        double sum = input->free_velocity[i];
        for (int j = 6 * first; j < 6 * end; j++) {
            sum += input->inverse_inertia[i * stride + j] * scratch->wrench[j];
        }
        result->velocity[i] = sum;
    }
}
