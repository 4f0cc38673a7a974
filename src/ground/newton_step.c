/* The equations of a contact step, and plain Newton steps. */
#include "ground/newton_step.h"

#define NEWTON_GROWTH 8.0     /* [-] a larger elimination factor calls for a row exchange */
#define NEWTON_HALVINGS 6     /* of a step that does not lower the residual */
#define NEWTON_NEAR 1e-5      /* [-] a residual below this share of the impulse may be rounding */
#define NEWTON_ROUNDING 6e-14 /* [-] rounding of V^ + A P: 256 units in the last place */
#define NEWTON_LENGTH 4e-16   /* [m] rounding of the elements' depths */

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

/* Vector p of the rows of a foot times a number each: sum + x_0 A_0 + ... + x_5 A_5. */
static inline Vector six_times(Vector sum, const double *x, const Row *A, int p) {
    sum += x[0] * A[0].part[p];
    sum += x[1] * A[1].part[p];
    sum += x[2] * A[2].part[p];
    sum += x[3] * A[3].part[p];
    sum += x[4] * A[4].part[p];
    sum += x[5] * A[5].part[p];
    return sum;
}

/* Subtracts a multiple of a vector from vector p of the rows of a foot. */
static inline void six_less(Row *M, const double *factor, Vector pivot, int p) {
    M[0].part[p] -= factor[0] * pivot;
    M[1].part[p] -= factor[1] * pivot;
    M[2].part[p] -= factor[2] * pivot;
    M[3].part[p] -= factor[3] * pivot;
    M[4].part[p] -= factor[4] * pivot;
    M[5].part[p] -= factor[5] * pivot;
}

void system_times(const System *system, const double *x, Row *y) {
    for (int p = 0; p < system->parts; p++) {
        Vector sum = y->part[p];
        for (int j = 0; j < system->n; j += 6) {
            sum = six_times(sum, x + j, system->A + j, p);
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

/* Factors of row k in the rows below it. Returns whether one is too large. */
static int rows_factors(const Row *M, int k, int n, double inverse, double *factor) {
    int grown = 0;
    for (int i = k + 1; i < n; i++) {
        factor[i] = M[i].at[k] * inverse;
        grown += fabs(factor[i]) <= NEWTON_GROWTH ? 0 : 1;
    }
    return grown;
}

/* Solves M x = right by Gaussian elimination. The right-hand side is column n of the rows. The
 * diagonal serves as the pivot unless a factor exceeds NEWTON_GROWTH. Vectors that lie left of the
 * diagonal are left as they are, because nobody reads them. */
static int rows_eliminate(const System *system, Row *M, double *x) {
    const int n = system->n;
    double inverse[TWIST_MAX], factor[TWIST_MAX];
    for (int k = 0; k < n; k++) {
        inverse[k] = 1.0 / M[k].at[k];
        if (rows_factors(M, k, n, inverse[k], factor)) {
            if (!rows_pivot(M, k, n)) {
                return 0;
            }
            inverse[k] = 1.0 / M[k].at[k];
            rows_factors(M, k, n, inverse[k], factor);
        }
        const int whole = (k / 6 + 1) * 6;
        for (int p = k / NEWTON_VECTOR; p < system->parts; p++) {
            const Vector pivot = M[k].part[p];
            for (int i = k + 1; i < whole; i++) {
                M[i].part[p] -= factor[i] * pivot;
            }
            for (int i = whole; i < n; i += 6) {
                six_less(M + i, factor + i, pivot, p);
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
    double apart[TWIST_MAX] = {0.0}; /* its first n are set, which no compiler can know */
    contact_pass(scratch, system->dt, point->twist.at);
    for (int i = 0; i < system->n; i++) {
        apart[i] = point->impulse.at[i] - scratch->wrench[listed_row(scratch, i)];
    }
    point->residual = system_norm(system, apart);
}

int point_solves(const System *system, const Point *point) {
    return point->rests ||
           point->residual <= system->tolerance * system_norm(system, point->impulse.at);
}

/* Row `i` of [1 + H A | right], i in the system. H: [6] of the row's foot, which has the rows from
 * `foot` on. */
static void row_newton(const System *system, int i, int foot, const double *H, double right,
                       Row *row) {
    /* 1 in one lane, from a window over one 1 among zeros: a number that is stored into a vector
     * delays the load of it. */
    static const double window[2 * NEWTON_LANES] = {[NEWTON_LANES] = 1.0};
    const double *one = window + NEWTON_LANES - i;
    const double *last = window + NEWTON_LANES - system->n;
    for (int p = 0; p < system->parts; p++) {
        Vector sum, end;
        memcpy(&sum, one + p * NEWTON_VECTOR, sizeof sum);
        memcpy(&end, last + p * NEWTON_VECTOR, sizeof end);
        sum = six_times(sum, H, system->A + foot, p);
        row->part[p] = sum + right * end;
    }
}

int point_step(const System *system, MildScratch *scratch, const Point *at, Point *next,
               int correct) {
    const int n = system->n;
    Row *M = system->M;
    double moved[TWIST_MAX] = {0.0};
    contact_hessian(scratch);
    for (int k = 0; k < n; k++) {
        /* the parts in use have been set, and n numbers are in them */
        /* NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult) */
        moved[k] = correct ? 0.0 : at->twist.at[k] - system->free.at[k];
    }
    for (int i = 0; i < n; i++) {
        const int foot = i / 6 * 6;
        const double *H = scratch->hessian[scratch->list[i / 6]] + 6 * (i - foot);
        double right =
            scratch->wrench[listed_row(scratch, i)] - (correct ? at->impulse.at[i] : 0.0);
        row_newton(system, i, foot, H, six_dot(right, H, moved + foot), &M[i]);
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

void point_halve(const System *system, MildScratch *scratch, const Point *at, Point *next) {
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
static int step_is_rounding(const System *system, const Point *from, const Point *to) {
    const int n = system->n;
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

void point_correct(const System *system, MildScratch *scratch, Point *at, Point *next) {
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
