#include <string.h>

#include "ground/contact.h"

#define NEWTON_TOLERANCE 1e-9
#define NEWTON_ITERATIONS 400 /* hard bound of work */
#define NEWTON_FIRST 100      /* of them before a second, more patient detour: 1 in 10 000 random problems */
#define NEWTON_PLAIN 12       /* of them without the detour over wide stick regions */
#define NEWTON_HALVINGS 6
#define NEWTON_WIDE 0.1       /* [m/s] first stick region of the detour */
#define NEWTON_NARROW 0.3     /* each is this much narrower than the one before */
#define NEWTON_LEVEL 1e-2     /* relative residual at which the next one begins */
#define NEWTON_PATIENCE 6     /* or this many steps */
#define NEWTON_PATIENT 20     /* and on the second detour */

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

static void point_evaluate(MildScratch *scratch, const MildContactInput *input, int n, double eps, Point *point) {
    contact_pass(scratch, input->dt, point->twist, eps);
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

static double newton_scale(int n, const MildContactInput *input, const double *impulse) {
    static const double zero[TWIST_MAX];
    return contact_residual(n, input->inverse_inertia, impulse, zero);
}

/* Newton's step from the last pass; false when the numbers have gone bad. */
static int newton_move(MildScratch *scratch, const MildContactInput *input, int n, Point *at, Point *next) {
    contact_hessian(scratch);
    if (!newton_step(scratch, input, n, at->twist, next->impulse)) return 0;
    point_twist(n, input, next);
    return 1;
}

static void point_between(int n, const Point *from, const Point *to, double t, Point *point) {
    for (int i = 0; i < n; i++) {
        point->impulse[i] = from->impulse[i] + t * (to->impulse[i] - from->impulse[i]);
        point->twist[i] = from->twist[i] + t * (to->twist[i] - from->twist[i]);
    }
}

/* Halves the step until the residual falls; false when it does not. */
static int newton_halve(MildScratch *scratch, const MildContactInput *input, int n, double eps, const Point *at, Point *next) {
    const Point full = *next;
    double t = 1.0;
    for (int k = 0; k < NEWTON_HALVINGS; k++) {
        t *= 0.5;
        point_between(n, at, &full, t, next);
        point_evaluate(scratch, input, n, eps, next);
        if (next->residual < (1.0 - 0.1 * t) * at->residual) return 1;
    }
    return 0;
}

/* Newton's method as it stands, as long as the residual falls. The common case: standing is one step, walking two or three. */
static int newton_plain(MildScratch *scratch, const MildContactInput *input, int n, double tolerance, int limit, Point *at) {
    Point next;
    int steps = 0;
    contact_pass(scratch, input->dt, at->twist, CONTACT_SLIP_SPEED);
    while (steps < limit && newton_move(scratch, input, n, at, &next)) {
        steps++;
        point_evaluate(scratch, input, n, CONTACT_SLIP_SPEED, &next);
        if (!(next.residual < at->residual) && !newton_halve(scratch, input, n, CONTACT_SLIP_SPEED, at, &next)) break;
        *at = next;
        if (at->residual <= tolerance * newton_scale(n, input, at->impulse)) break;
    }
    return steps;
}

/* The detour where Newton's method alone does not arrive: a foot that turns about a point under its sole has an element
 * whose velocity must be found to within the stick region, a needle's eye of 1e-6 m/s. With a wide region the problem is
 * easy; it is then narrowed step by step, the friction's directions l being kept from one region to the next. */
static int newton_narrow(MildScratch *scratch, const MildContactInput *input, int n, double tolerance, int limit, int patience,
                         Point *best) {
    double eps = NEWTON_WIDE;
    Point at = {.residual = INFINITY}, next;
    memcpy(at.twist, input->velocity, (size_t)n * sizeof(double));
    int steps = 0, left = patience;
    contact_pass(scratch, input->dt, at.twist, eps);
    contact_dual_start(scratch, at.twist, eps);
    while (steps < limit && newton_move(scratch, input, n, &at, &next)) {
        steps++;
        point_evaluate(scratch, input, n, eps, &next);
        if (!(next.residual < at.residual)) newton_halve(scratch, input, n, eps, &at, &next); /* a small step if in vain */
        contact_dual(scratch, at.twist, next.twist, eps);
        at = next;
        if (!(at.residual < INFINITY)) break;
        double scale = newton_scale(n, input, at.impulse);
        if (eps == CONTACT_SLIP_SPEED) {
            if (at.residual < best->residual) *best = at;
            if (at.residual <= tolerance * scale) break;
        } else if (at.residual <= NEWTON_LEVEL * scale || --left == 0) {
            left = patience;
            eps = fmax(NEWTON_NARROW * eps, CONTACT_SLIP_SPEED);
            contact_pass(scratch, input->dt, at.twist, eps);
            at.residual = INFINITY;
        }
        contact_dual_stiffness(scratch, at.twist, eps);
    }
    return steps;
}

void newton_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result) {
    int n = 6 * scratch->feet, limit = input->max_iterations > 0 ? input->max_iterations : NEWTON_ITERATIONS;
    double tolerance = input->tolerance > 0.0 ? input->tolerance : NEWTON_TOLERANCE;
    Point at = {.residual = INFINITY};
    memcpy(at.twist, input->velocity, (size_t)n * sizeof(double));
    int plain = limit < NEWTON_PLAIN ? limit : NEWTON_PLAIN;
    int iterations = newton_plain(scratch, input, n, tolerance, plain, &at);
    double scale = newton_scale(n, input, at.impulse);
    for (int second = 0; second < 2 && !(at.residual <= tolerance * scale); second++) {
        int end = !second && limit > NEWTON_FIRST ? NEWTON_FIRST : limit, patience = second ? NEWTON_PATIENT : NEWTON_PATIENCE;
        iterations += newton_narrow(scratch, input, n, tolerance, end - iterations, patience, &at);
        contact_pass(scratch, input->dt, at.twist, CONTACT_SLIP_SPEED);
        scale = newton_scale(n, input, at.impulse);
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
