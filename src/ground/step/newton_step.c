/* The equations of a contact step, and plain Newton steps. */
#include "ground/step/newton_step.h"

#define NEWTON_GROWTH 8.0 /* [-] a larger elimination factor calls for a row exchange */
#define NEWTON_HALVINGS 6 /* of a step that does not lower the residual */
#define NEWTON_NEAR 1e-5  /* [-] a residual below this share of the impulse may be rounding */
#ifdef MILD_REAL_FLOAT
#define NEWTON_ROUNDING 3e-5 /* [-] rounding of V^ + A P: 256 units in the last place */
#define NEWTON_LENGTH 2e-9   /* [m] rounding of the elements' depths */
#else
#define NEWTON_ROUNDING 6e-14
#define NEWTON_LENGTH 4e-16
#endif

/* ---- rows ---- */

void row_clear(const System *system, Row *row) {
    for (int p = 0; p < system->parts; p++) {
        row->part[p] = (Vector){0.0};
    }
}

/* sum + x_0 y_0 + ... + x_5 y_5. Written out, here and below: a loop over the six rows of a foot
 * takes longer, because the compiler vectorises this one, and does not unroll the others. */
static inline double six_dot(double sum, const double *x, const double *y) {
    sum += x[0] * y[0];
    sum += x[1] * y[1];
    sum += x[2] * y[2];
    sum += x[3] * y[3];
    sum += x[4] * y[4];
    sum += x[5] * y[5];
    return sum;
}

/* A vector of the rows of a foot, `parts` apart, times a number each: sum + x_0 A_0 + ... + x_5
 * A_5. */
static inline Vector six_times(Vector sum, const double *x, const Vector *A, int parts) {
    sum += x[0] * A[0];
    sum += x[1] * A[parts];
    sum += x[2] * A[2 * parts];
    sum += x[3] * A[3 * parts];
    sum += x[4] * A[4 * parts];
    sum += x[5] * A[5 * parts];
    return sum;
}

/* Subtracts a multiple of a vector from one of the rows of a foot. */
static inline void six_less(Vector *M, const double *factor, Vector pivot, int parts) {
    M[0] -= factor[0] * pivot;
    M[parts] -= factor[1] * pivot;
    M[2 * parts] -= factor[2] * pivot;
    M[3 * parts] -= factor[3] * pivot;
    M[4 * parts] -= factor[4] * pivot;
    M[5 * parts] -= factor[5] * pivot;
}

/* Number k of row i. */
static inline double entry(const Vector *M, int parts, int i, int k) {
    return ((const double *)(M + (ptrdiff_t)i * parts))[k];
}

void system_times(const System *system, const double *x, Row *y) {
    for (int p = 0; p < system->parts; p++) {
        Vector sum = y->part[p];
        for (int j = 0; j < system->n; j += 6) {
            sum = six_times(sum, x + j, system->A + j * system->parts + p, system->parts);
        }
        y->part[p] = sum;
    }
}

double system_norm(const System *system, const double *x) {
    Row y;
    double sum = 0.0;
    row_clear(system, &y);
    system_times(system, x, &y);
    for (int i = 0; i < system->n; i++) {
        /* row_clear has set these: n numbers are in `parts` parts */
        /* NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult) */
        sum += x[i] * y.at[i];
    }
    return sqrt(fmax(sum, 0.0));
}

/* ---- elimination ---- */

/* Swaps row k with the row at or below it that has the largest number in column k. Returns false
 * when that number is zero. */
static __attribute__((cold)) int rows_pivot(Vector *M, int parts, int k, int n) {
    int pivot = k;
    for (int i = k + 1; i < n; i++) {
        if (fabs(entry(M, parts, i, k)) > fabs(entry(M, parts, pivot, k))) {
            pivot = i;
        }
    }
    for (int p = 0; p < parts; p++) {
        const Vector swapped = M[k * parts + p];
        M[k * parts + p] = M[pivot * parts + p];
        M[pivot * parts + p] = swapped;
    }
    return fabs(entry(M, parts, k, k)) > 0.0;
}

/* Factors of row k in the rows below it. Returns whether one is too large. */
static int rows_factors(const Vector *M, int parts, int k, int n, double inverse, double *factor) {
    int grown = 0;
    for (int i = k + 1; i < n; i++) {
        factor[i] = entry(M, parts, i, k) * inverse;
        grown += fabs(factor[i]) <= NEWTON_GROWTH ? 0 : 1;
    }
    return grown;
}

/* Solves M x = right by Gaussian elimination. The right-hand side is column n of the rows. The
 * diagonal serves as the pivot unless a factor exceeds NEWTON_GROWTH. Vectors that lie left of the
 * diagonal are left as they are, because nobody reads them. */
static int rows_eliminate(const System *system, Vector *M, double *x) {
    const int n = system->n, parts = system->parts;
    double inverse[TWIST_MAX], factor[TWIST_MAX];
    for (int k = 0; k < n; k++) {
        inverse[k] = 1.0 / entry(M, parts, k, k);
        if (rows_factors(M, parts, k, n, inverse[k], factor)) {
            if (!rows_pivot(M, parts, k, n)) {
                return 0;
            }
            inverse[k] = 1.0 / entry(M, parts, k, k);
            rows_factors(M, parts, k, n, inverse[k], factor);
        }
        const int whole = (k / 6 + 1) * 6;
        for (int p = k / NEWTON_VECTOR; p < parts; p++) {
            const Vector pivot = M[k * parts + p];
            for (int i = k + 1; i < whole; i++) {
                M[i * parts + p] -= factor[i] * pivot;
            }
            for (int i = whole; i < n; i += 6) {
                six_less(M + i * parts + p, factor + i, pivot, parts);
            }
        }
    }
    for (int i = 0; i < n; i++) {
        x[i] = entry(M, parts, i, n);
    }
    for (int j = n - 1; j >= 0; j--) {
        x[j] *= inverse[j];
        for (int i = 0; i < j; i++) {
            x[i] -= entry(M, parts, i, j) * x[j];
        }
    }
    return 1;
}

/* ---- points ---- */

static void point_copy(const System *system, Point *to, const Point *from) {
    for (int p = 0; p < system->parts; p++) {
        to->impulse.part[p] = from->impulse.part[p];
        to->twist.part[p] = from->twist.part[p];
    }
    to->residual = from->residual;
    to->rests = from->rests;
}

void point_evaluate(const System *system, MildScratch *scratch, Point *point) {
    Row apart;
    row_clear(system, &apart);
    contact_pass(scratch, system->dt, point->twist.at);
    for (int i = 0; i < system->n; i++) {
        apart.at[i] = point->impulse.at[i] - scratch->wrench[listed_row(scratch, i)];
    }
    point->residual = system_norm(system, apart.at);
}

int point_solves(const System *system, const Point *point) {
    return point->rests ||
           point->residual <= system->tolerance * system_norm(system, point->impulse.at);
}

/* Row `i` of [1 + H A | right], i in the system. H: [6] of the row's foot, which has the rows from
 * `foot` on. lane: a 1 among zeros; a window over it has 1 in one lane. A number that is stored
 * into a vector would delay the load of it. */
static void row_newton(const System *system, int i, int foot, const double *H, double right,
                       const double *lane, Vector *row) {
    const double *one = lane - i;
    const double *last = lane - system->n;
    for (int p = 0; p < system->parts; p++) {
        Vector sum, end;
        memcpy(&sum, one + p * NEWTON_VECTOR, sizeof sum);
        memcpy(&end, last + p * NEWTON_VECTOR, sizeof end);
        sum = six_times(sum, H, system->A + foot * system->parts + p, system->parts);
        row[p] = sum + right * end;
    }
}

int point_step(const System *system, MildScratch *scratch, const Point *at, Point *next,
               int correct) {
    const int n = system->n;
    Vector *M = system->M;
    Row moved;
    row_clear(system, &moved);
    contact_hessian(scratch);
    for (int k = 0; k < n; k++) {
        /* the parts in use have been set, and n numbers are in them */
        /* NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult) */
        moved.at[k] = correct ? 0.0 : at->twist.at[k] - system->free.at[k];
    }
    for (int i = 0; i < n; i++) {
        const int foot = i / 6 * 6;
        const double *H = scratch->hessian[scratch->list[i / 6]] + 6 * (i - foot);
        double right =
            scratch->wrench[listed_row(scratch, i)] - (correct ? at->impulse.at[i] : 0.0);
        row_newton(system, i, foot, H, six_dot(right, H, moved.at + foot),
                   scratch->window + ROW_LANES, M + i * system->parts);
    }
    next->rests = 0;
    row_clear(system, &next->impulse);
    if (!rows_eliminate(system, M, next->impulse.at)) {
        return 0;
    }
    const Row *from = correct ? &at->twist : &system->free;
    memcpy(next->twist.part, from->part, (size_t)system->parts * sizeof(Vector));
    system_times(system, next->impulse.at, &next->twist);
    for (int i = 0; correct && i < n; i++) {
        next->impulse.at[i] += at->impulse.at[i];
    }
    return 1;
}

void point_between(const System *system, const Point *from, const Point *to, double t,
                   Point *point) {
    for (int i = 0; i < system->n; i++) {
        point->impulse.at[i] = from->impulse.at[i] + t * (to->impulse.at[i] - from->impulse.at[i]);
        point->twist.at[i] = from->twist.at[i] + t * (to->twist.at[i] - from->twist.at[i]);
    }
}

__attribute__((cold)) void point_halve(const System *system, MildScratch *scratch, const Point *at,
                                       Point *next) {
    const Point full = *next;
    double t = 1.0;
    for (int k = 0; k < NEWTON_HALVINGS; k++) {
        t *= 0.5;
        point_between(system, at, &full, t, next);
        point_evaluate(system, scratch, next);
        if (next->residual < (1.0 - 0.1 * t) * at->residual) {
            return;
        }
    }
}

/* Bool: the step between two points is within the rounding error of V^ + A P and of the depths to
 * which dt V is added. */
static __attribute__((cold)) int step_is_rounding(const System *system, const Point *from,
                                                  const Point *to) {
    const int n = system->n;
    double size = 0.0;
    for (int i = 0; i < n; i++) {
        double sum = fabs(system->free.at[i]);
        for (int j = 0; j < n; j++) {
            sum += fabs(entry(system->A, system->parts, i, j) * from->impulse.at[j]);
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

__attribute__((cold)) void point_correct(const System *system, MildScratch *scratch, Point *at,
                                         Point *next) {
    double scale = system_norm(system, at->impulse.at);
    if (!(at->residual <= NEWTON_NEAR * scale + NEWTON_LENGTH)) {
        return;
    }
    Point corrected;
    contact_pass(scratch, system->dt, at->twist.at);
    if (!point_step(system, scratch, at, &corrected, 1)) {
        return;
    }
    at->rests = step_is_rounding(system, at, &corrected);
    if (!at->rests) {
        point_evaluate(system, scratch, &corrected);
        *next = corrected;
    }
}

int newton_plain(const System *system, MildScratch *scratch, Point *best, int limit) {
    Point at, next;
    int steps = 0, solved = 0;
    point_copy(system, &at, best);
    while (!solved && steps < limit && point_step(system, scratch, &at, &next, 0)) {
        steps++;
        point_evaluate(system, scratch, &next);
        if (!(next.residual < at.residual)) {
            point_correct(system, scratch, &at, &next);
        }
        if (at.rests) {
            point_copy(system, best, &at);
            break;
        }
        if (!(next.residual < at.residual)) {
            point_halve(system, scratch, &at, &next);
        }
        point_copy(system, &at, &next);
        solved = point_solves(system, &at);
        if (solved || at.residual < best->residual) {
            point_copy(system, best, &at);
        }
    }
    return steps;
}
