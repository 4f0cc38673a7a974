#include <string.h>

#include "ground/contact.h"

#define NEWTON_TOLERANCE 1e-9
#define NEWTON_ITERATIONS 60
#define NEWTON_HALVINGS 6
#define NEWTON_SEARCHES 12

/* One point of the search: impulse P, foot twists V = V^ + A P. */
typedef struct {
    double impulse[TWIST_MAX], twist[TWIST_MAX];
    double residual;
} Point;

static void point_twist(int n, const MildContactInput *input, Point *point) {
    for (int i = 0; i < n; i++) {
        double sum = input->free_velocity[i];
        for (int j = 0; j < n; j++) sum += input->inverse_inertia[i * n + j] * point->impulse[j];
        point->twist[i] = sum;
    }
}

static void point_evaluate(MildScratch *scratch, const MildContactInput *input, int n, Point *point) {
    contact_pass(scratch, input->dt, point->twist, 1);
    point->residual = contact_residual(n, input->inverse_inertia, point->impulse, scratch->wrench);
}

/* Gaussian elimination with partial pivoting; x holds the right side, then the solution. Inline, so that n is a constant
 * in each of its two uses. */
static inline int solve_dense(int n, double a[TWIST_MAX][TWIST_MAX], double *x) {
    for (int k = 0; k < n; k++) {
        int pivot = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(a[i][k]) > fabs(a[pivot][k])) pivot = i;
        if (!(fabs(a[pivot][k]) > 0.0)) return 0;
        if (pivot != k) {
            for (int j = k; j < n; j++) {
                double swap = a[k][j];
                a[k][j] = a[pivot][j];
                a[pivot][j] = swap;
            }
            double swap = x[k];
            x[k] = x[pivot];
            x[pivot] = swap;
        }
        double inverse = 1.0 / a[k][k];
        for (int i = k + 1; i < n; i++) {
            double factor = a[i][k] * inverse;
            for (int j = k + 1; j < n; j++) a[i][j] -= factor * a[k][j];
            x[i] -= factor * x[k];
        }
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int j = i + 1; j < n; j++) x[i] -= a[i][j] * x[j];
        x[i] /= a[i][i];
    }
    return 1;
}

/* The law linearised at twist V: W + H (V - V^ - A P) = P, that is (I + H A) P = W + H (V - V^). */
static inline int newton_step_of(const MildScratch *scratch, const MildContactInput *input, int n, const double *twist,
                                 double *impulse) {
    double matrix[TWIST_MAX][TWIST_MAX];
    for (int i = 0; i < n; i++) {
        const double *H = scratch->hessian[i / 6] + 6 * (i % 6);
        int first = i / 6 * 6;
        double sum = scratch->wrench[i], row[TWIST_MAX] = {0.0};
        for (int k = 0; k < 6; k++) {
            sum += H[k] * (twist[first + k] - input->free_velocity[first + k]);
            for (int j = 0; j < n; j++) row[j] += H[k] * input->inverse_inertia[(first + k) * n + j];
        }
        row[i] += 1.0;
        for (int j = 0; j < n; j++) matrix[i][j] = row[j];
        impulse[i] = sum;
    }
    return solve_dense(n, matrix, impulse);
}

static int newton_step(const MildScratch *scratch, const MildContactInput *input, int n, const double *twist, double *impulse) {
    return n == 6 ? newton_step_of(scratch, input, 6, twist, impulse)
                  : newton_step_of(scratch, input, TWIST_MAX, twist, impulse);
}

static void point_between(int n, const Point *from, const Point *to, double t, Point *point) {
    for (int i = 0; i < n; i++) {
        point->impulse[i] = from->impulse[i] + t * (to->impulse[i] - from->impulse[i]);
        point->twist[i] = from->twist[i] + t * (to->twist[i] - from->twist[i]);
    }
}

/* Newton's step with halving on the residual. False when nothing on the way was better. */
static int newton_exact(MildScratch *scratch, const MildContactInput *input, int n, const Point *at, Point *next) {
    if (!newton_step(scratch, input, n, at->twist, next->impulse)) return 0;
    point_twist(n, input, next);
    point_evaluate(scratch, input, n, next);
    if (next->residual < at->residual) return 1;
    const Point full = *next;
    double t = 1.0;
    for (int k = 0; k < NEWTON_HALVINGS; k++) {
        t *= 0.5;
        point_between(n, at, &full, t, next);
        point_evaluate(scratch, input, n, next);
        if (next->residual < (1.0 - 0.1 * t) * at->residual) return 1;
    }
    return 0;
}

/* Slope of the convex function along the step, up to its length: dV . (P - W). */
static double step_slope(int n, const Point *from, const Point *to, const Point *here, const double *wrench) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) sum += (to->twist[i] - from->twist[i]) * (here->impulse[i] - wrench[i]);
    return sum;
}

/* A step that cannot fail on the convex function with the friction bounds as they are at each point: majorised Hessian,
 * then the root of the slope along the step by bisection and secants. */
static int newton_safe(MildScratch *scratch, const MildContactInput *input, int n, const Point *at, Point *next) {
    contact_pass(scratch, input->dt, at->twist, 0);
    contact_hessian(scratch);
    if (!newton_step(scratch, input, n, at->twist, next->impulse)) return 0;
    point_twist(n, input, next);
    const Point full = *next;
    double low = 0.0, high = 1.0, start = step_slope(n, at, &full, at, scratch->wrench), slope_low = start;
    point_evaluate(scratch, input, n, next);
    double slope = step_slope(n, at, &full, next, scratch->wrench), slope_high = slope;
    for (int k = 0; k < NEWTON_SEARCHES && slope > 0.1 * fabs(start); k++) {
        double t = k % 2 ? 0.5 * (low + high) : low + (high - low) * slope_low / (slope_low - slope_high);
        point_between(n, at, &full, t, next);
        point_evaluate(scratch, input, n, next);
        slope = step_slope(n, at, &full, next, scratch->wrench);
        if (slope > 0.0) {
            high = t;
            slope_high = slope;
        } else {
            low = t;
            slope_low = slope;
            if (slope > -0.1 * fabs(start)) break;
        }
    }
    return 1;
}

static double newton_scale(int n, const MildContactInput *input, const double *impulse) {
    static const double zero[TWIST_MAX];
    return contact_residual(n, input->inverse_inertia, impulse, zero);
}

void newton_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result) {
    int n = 6 * scratch->feet, limit = input->max_iterations > 0 ? input->max_iterations : NEWTON_ITERATIONS;
    double tolerance = input->tolerance > 0.0 ? input->tolerance : NEWTON_TOLERANCE, scale = 0.0;
    Point at = {.residual = INFINITY}, best = at, next;
    memcpy(at.twist, input->velocity, (size_t)n * sizeof(double));
    contact_pass(scratch, input->dt, at.twist, 1);
    int iterations = 0;
    while (iterations < limit) {
        iterations++;
        contact_hessian(scratch);
        if (!newton_exact(scratch, input, n, &at, &next) && !newton_safe(scratch, input, n, &at, &next)) break;
        at = next;
        if (at.residual < best.residual) best = at;
        scale = newton_scale(n, input, at.impulse);
        if (at.residual <= tolerance * scale) break;
    }
    if (best.residual < at.residual) {
        at = best;
        contact_pass(scratch, input->dt, at.twist, 1);
    }
    result->iterations = iterations;
    result->residual = scale > 0.0 ? at.residual / scale : at.residual;
    result->converged = at.residual <= tolerance * scale;
    for (int i = 0; i < n; i++) {
        double sum = input->free_velocity[i];
        for (int j = 0; j < n; j++) sum += input->inverse_inertia[i * n + j] * scratch->wrench[j];
        result->velocity[i] = sum;
    }
}
