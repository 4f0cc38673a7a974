#include <string.h>

#include "ground/contact.h"

#define NEWTON_TOLERANCE 1e-9
#define NEWTON_ITERATIONS 60
#define NEWTON_HALVINGS 6

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
    contact_pass(scratch, input->dt, point->twist);
    point->residual = contact_residual(n, input->inverse_inertia, point->impulse, scratch->wrench);
}

/* Gaussian elimination with partial pivoting; x holds the right side, then the solution. */
static int solve_dense(int n, double a[TWIST_MAX][TWIST_MAX], double *x) {
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
static int newton_step(const MildScratch *scratch, const MildContactInput *input, int n, const double *twist, double *impulse) {
    double matrix[TWIST_MAX][TWIST_MAX];
    memset(matrix, 0, sizeof matrix);
    for (int i = 0; i < n; i++) {
        const double *H = scratch->hessian[i / 6] + 6 * (i % 6);
        int first = i / 6 * 6;
        double sum = scratch->wrench[i];
        for (int k = 0; k < 6; k++) {
            sum += H[k] * (twist[first + k] - input->free_velocity[first + k]);
            for (int j = 0; j < n; j++) matrix[i][j] += H[k] * input->inverse_inertia[(first + k) * n + j];
        }
        matrix[i][i] += 1.0;
        impulse[i] = sum;
    }
    return solve_dense(n, matrix, impulse);
}

static void point_between(int n, const Point *from, const Point *to, double t, Point *point) {
    for (int i = 0; i < n; i++) {
        point->impulse[i] = from->impulse[i] + t * (to->impulse[i] - from->impulse[i]);
        point->twist[i] = from->twist[i] + t * (to->twist[i] - from->twist[i]);
    }
}

static double newton_scale(int n, const MildContactInput *input, const double *impulse) {
    static const double zero[TWIST_MAX];
    return contact_residual(n, input->inverse_inertia, impulse, zero);
}

void newton_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result) {
    int n = 6 * scratch->feet, limit = input->max_iterations > 0 ? input->max_iterations : NEWTON_ITERATIONS;
    double tolerance = input->tolerance > 0.0 ? input->tolerance : NEWTON_TOLERANCE;
    Point at, next;
    memcpy(at.twist, input->velocity, (size_t)n * sizeof(double));
    contact_pass(scratch, input->dt, at.twist);
    at.residual = INFINITY;
    double scale = 0.0;
    int iterations = 0;
    while (iterations < limit) {
        iterations++;
        contact_hessian(scratch);
        if (!newton_step(scratch, input, n, at.twist, next.impulse)) break;
        point_twist(n, input, &next);
        point_evaluate(scratch, input, n, &next);
        if (next.residual > at.residual) {
            Point full = next;
            double t = 1.0;
            for (int k = 0; k < NEWTON_HALVINGS && next.residual > at.residual; k++) {
                t *= 0.5;
                point_between(n, &at, &full, t, &next);
                point_evaluate(scratch, input, n, &next);
            }
        }
        at = next;
        scale = newton_scale(n, input, at.impulse);
        if (at.residual <= tolerance * scale) break;
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
