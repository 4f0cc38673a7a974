#include <string.h>

#include "ground/friction.h"
#include "ground/pass.h"
#include "ground/solver.h"

#define NEWTON_TOLERANCE 1e-9 /* [-] of the residual, unless the caller sets one */
#define NEWTON_ITERATIONS 400 /* Newton steps in all, unless the caller sets a limit */
#define NEWTON_PLAIN 20       /* plain steps before the friction bounds are held fixed */
#define NEWTON_ROUND 20       /* steps of one minimisation at fixed bounds */
#define NEWTON_TRY 6          /* plain steps tried after each minimisation */
#define NEWTON_HALVINGS 6     /* of a step that does not lower the residual */
#define NEWTON_SEARCH 30      /* bisections of a line search */
#define NEWTON_GROWTH 8.0     /* [-] a larger elimination factor calls for a row exchange */
#define NEWTON_NEAR 1e-5      /* [-] a residual below this share of the impulse may be rounding */
#define NEWTON_ROUNDING 6e-14 /* [-] rounding of V^ + A P: 256 units in the last place */
#define NEWTON_LENGTH 4e-16   /* [m] rounding of the elements' depths */
#define BOUNDS_LEAST 0.02     /* [-] smallest step length of the friction bounds */
#define BOUNDS_MOST 1e4       /* [-] largest */
#define BOUNDS_SLOW 0.5       /* [-] a move that shrank by less than this factor is slow */
#define BOUNDS_PATIENCE 10    /* rounds before the bounds restart from wider ones */

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
_Static_assert(TWIST_MAX == 24, "newton_step lists the rows of a unit matrix");

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

static int least(int a, int b) {
    return a < b ? a : b;
}

/* The functions below are compiled three times: for one loaded foot, for two, and for more. There
 * are n rows. Each uses `parts` vectors, the last of which also holds the right-hand side. The
 * other vectors of a row are neither read nor written. */

ALWAYS_INLINE void row_clear(Row *row, int parts) {
    for (int p = 0; p < parts; p++) {
        row->part[p] = (Vector){0.0};
    }
}

/* Sets the first n numbers of a row and clears the rest. */
ALWAYS_INLINE void row_load(Row *row, const double *values, int n, int parts) {
    row_clear(row, parts);
    memcpy(row->at, values, (size_t)n * sizeof *values);
}

ALWAYS_INLINE void row_copy(Row *to, const Row *from, int parts) {
    for (int p = 0; p < parts; p++) {
        to->part[p] = from->part[p];
    }
}

ALWAYS_INLINE void point_copy(Point *to, const Point *from, int parts) {
    row_copy(&to->impulse, &from->impulse, parts);
    row_copy(&to->twist, &from->twist, parts);
    to->residual = from->residual;
    to->rests = from->rests;
}

ALWAYS_INLINE void system_open(System *system, const MildScratch *scratch,
                               const MildContactInput *input, int first, int n, int parts) {
    int stride = 6 * scratch->feet;
    system->first = first;
    for (int i = 0; i < n; i++) {
        row_load(&system->A[i], input->inverse_inertia + (first + i) * stride + first, n, parts);
    }
    row_load(&system->free, input->free_velocity + first, n, parts);
    system->tolerance = input->tolerance > 0.0 ? input->tolerance : NEWTON_TOLERANCE;
    system->limit = input->max_iterations > 0 ? input->max_iterations : NEWTON_ITERATIONS;
    system->dt = input->dt;
}

/* y += A x; A is symmetric. */
ALWAYS_INLINE void system_times(const System *system, const double *x, Row *y, int n, int parts) {
    for (int j = 0; j < n; j++) {
        for (int p = 0; p < parts; p++) {
            y->part[p] += x[j] * system->A[j].part[p];
        }
    }
}

/* sqrt(x^T A x), the norm of an impulse in the metric of kinetic energy. */
ALWAYS_INLINE double system_norm(const System *system, const double *x, int n, int parts) {
    Row y;
    double sum = 0.0;
    row_clear(&y, parts);
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

/* Solves M x = right by Gaussian elimination. The right-hand side is column n of the rows. The
 * diagonal serves as the pivot unless a factor exceeds NEWTON_GROWTH. */
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
ALWAYS_INLINE int point_step(const System *system, MildScratch *scratch, const Point *at,
                             Point *next, int correct, int n, int parts) {
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
        moved[k] = correct ? 0.0 : at->twist.at[k] - system->free.at[k];
    }
    for (int i = 0; i < n; i++) {
        int foot = i / 6 * 6;
        const double *H = scratch->hessian[(system->first + foot) / 6] + 6 * (i - foot);
        double right = scratch->wrench[system->first + i] - (correct ? at->impulse.at[i] : 0.0);
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

ALWAYS_INLINE void point_between(const Point *from, const Point *to, double t, Point *point,
                                 int n) {
    for (int i = 0; i < n; i++) {
        point->impulse.at[i] = from->impulse.at[i] + t * (to->impulse.at[i] - from->impulse.at[i]);
        point->twist.at[i] = from->twist.at[i] + t * (to->twist.at[i] - from->twist.at[i]);
    }
}

/* Halves the step until the residual falls. If it never does, keeps the shortest step, which may
 * lead across a kink of the law. */
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
    return point->rests ||
           point->residual <= system->tolerance * system_norm(system, point->impulse.at, n, parts);
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

/* The step from `at` to `next` did not lower the residual. Near the solution the reason may be
 * rounding, so repeat the step as a correction. If the correction is itself within rounding, `at`
 * is the solution. */
static void point_correct(const System *system, MildScratch *scratch, Point *at, Point *next, int n,
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

/* Plain Newton steps from `best`, at which the last pass was made. Leaves the best point seen in
 * `best`. Returns the number of steps. */
ALWAYS_INLINE int newton_plain(const System *system, MildScratch *scratch, Point *best, int limit,
                               int n, int parts) {
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

/* With the friction bounds held fixed, the step minimises a convex function. This is its slope
 * along the step between two points, (P - W)^T A dP, at the point of the last pass. */
static double step_slope(const System *system, const MildScratch *scratch, const Point *at,
                         const Point *from, const Point *to, int n) {
    double slope = 0.0;
    for (int i = 0; i < n; i++) {
        slope += (at->impulse.at[i] - scratch->wrench[system->first + i]) *
                 (to->twist.at[i] - from->twist.at[i]);
    }
    return slope;
}

/* Minimises the convex function that the step has at fixed friction bounds. Newton's method with a
 * line search converges from any start. Returns the number of steps. */
static int newton_held(const System *system, MildScratch *scratch, Point *at, int limit, int n,
                       int parts) {
    int steps = 0, moves = 1;
    Point full, next = *at;
    contact_pass_held(scratch, system->dt, at->twist.at, system->first);
    while (moves && steps < limit && point_step(system, scratch, at, &full, 0, n, parts)) {
        steps++;
        double start = step_slope(system, scratch, at, at, &full, n);
        double end;
        double low = 0.0;
        double high = 1.0;
        double t = 1.0;
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
        double moved[TWIST_MAX];
        double scale = system_norm(system, next.impulse.at, n, parts);
        for (int i = 0; i < n; i++) {
            moved[i] = next.impulse.at[i] - at->impulse.at[i];
        }
        *at = next;
        moves = !(system_norm(system, moved, n, parts) <= 0.1 * system->tolerance * scale);
    }
    return steps;
}

/* [N s] Friction bound for the normal impulse of the last pass. */
static inline double bound_wanted(const Slots *s, int i) {
    const Element element = slot_element(s, i);
    return friction_bound(&element, s->iz[i]);
}

/* Sets the friction bounds to a multiple of those for the last pass. */
static void bounds_begin(MildScratch *scratch, double times) {
    for (int f = 0; f < scratch->feet; f++) {
        const Slots *s = &scratch->foot[f].slot;
        for (int i = 0; i < foot_end(&scratch->foot[f]); i++) {
            s->bound[i] = times * bound_wanted(s, i);
            s->bound_moved[i] = 0.0;
        }
    }
}

/* Step length of the friction bounds. */
typedef struct {
    double share; /* [-] of the distance to the wanted bounds, in the last move */
    int turned;   /* bool: that move reversed direction */
} Pace;

/* Chooses the next step length. It doubles while the moves keep their direction and hardly shorten,
 * because where friction presses the foot into the ground the bounds grow slowly over many orders
 * of magnitude. When the moves reverse, it goes the whole way back, but at most to the middle of
 * the last move. */
static void bounds_pace(const MildScratch *scratch, Pace *pace) {
    double along = 0.0;  /* [N^2 s^2] wanted move times last move */
    double now = 0.0;    /* [N^2 s^2] square of the wanted move */
    double before = 0.0; /* [N^2 s^2] square of the last move */
    double share = pace->share;
    for (int f = 0; f < scratch->feet; f++) {
        const Slots *s = &scratch->foot[f].slot;
        for (int i = 0; i < foot_end(&scratch->foot[f]); i++) {
            double way = bound_wanted(s, i) - s->bound[i], last = s->bound_moved[i];
            along += way * last;
            now += way * way;
            before += last * last;
        }
    }
    int turned = along < 0.0;
    if (turned) {
        share = fmin(1.0, 0.5 * before / -along);
    } else if (!pace->turned && now * share * share > BOUNDS_SLOW * BOUNDS_SLOW * before) {
        share = fmin(2.0 * share, BOUNDS_MOST);
    }
    *pace = (Pace){fmax(share, BOUNDS_LEAST), turned};
}

/* Moves the friction bounds towards those for the last pass. */
static void bounds_move(MildScratch *scratch, Pace *pace) {
    bounds_pace(scratch, pace);
    for (int f = 0; f < scratch->feet; f++) {
        const Slots *s = &scratch->foot[f].slot;
        for (int i = 0; i < foot_end(&scratch->foot[f]); i++) {
            double way = pace->share * (bound_wanted(s, i) - s->bound[i]);
            s->bound_moved[i] = fmax(way, -s->bound[i]);
            s->bound[i] += s->bound_moved[i];
        }
    }
}

/* For steps on which plain Newton diverges because the bounds depend on I_z, or cycles over kinks
 * of the law. Alternate: minimise with the friction bounds fixed, move the bounds towards those at
 * the minimum, and try plain steps from there. Every BOUNDS_PATIENCE rounds, restart from bounds
 * several times as wide. Returns the number of steps. */
static int newton_patient(const System *system, MildScratch *scratch, Point *best, int limit, int n,
                          int parts) {
    static const double wider[] = {3.0, 100.0, 10.0, 1e4};
    Point at = *best;
    Pace pace = {0.5, 0}; /* the first move doubles it */
    int steps = 0;
    if (isinf(at.residual)) {
        at.twist = system->free; /* the point with zero impulse */
    }
    contact_pass(scratch, system->dt, at.twist.at, system->first);
    bounds_begin(scratch, 1.0);
    for (int round = 1; steps < limit && !point_solves(system, best, n, parts); round++) {
        int held = newton_held(system, scratch, &at, least(limit - steps, NEWTON_ROUND), n, parts);
        if (held == 0) {
            break; /* singular or not a number */
        }
        steps += held;
        point_evaluate(system, scratch, &at, n, parts);
        if (round % BOUNDS_PATIENCE == 0) {
            bounds_begin(scratch, wider[(round / BOUNDS_PATIENCE - 1) % 4]);
            pace = (Pace){1.0, 1};
        } else {
            bounds_move(scratch, &pace);
        }
        Point tried = at;
        steps += newton_plain(system, scratch, &tried, least(limit - steps, NEWTON_TRY), n, parts);
        if (tried.rests || tried.residual < best->residual) {
            *best = tried;
        }
    }
    return steps;
}

/* Sets a point to what would be returned for it: P = W of the last pass and V = V^ + A W. Its
 * residual becomes relative. It is infinite where W = 0 but the law at V is not. */
static void point_return(const System *system, MildScratch *scratch, Point *point, int n,
                         int parts) {
    point->impulse = (Row){{0.0}};
    memcpy(point->impulse.at, scratch->wrench + system->first, (size_t)n * sizeof(double));
    point->twist = system->free;
    system_times(system, point->impulse.at, &point->twist, n, parts);
    point_evaluate(system, scratch, point, n, parts);
    if (point->residual > 0.0) {
        point->residual /= system_norm(system, point->impulse.at, n, parts);
    }
}

/* Chooses what to return for a step that the search has left unsolved. Its best point may be far
 * from a solution even with a small residual: its impulses may be zero deep in the ground. The
 * alternative is a minimum at fixed friction bounds, taken from the normal impulses without
 * friction. There every normal impulse obeys the law at the new velocity, and only the friction
 * bound does not. Returns the candidate closer to the law in `scratch` and `result`, and the number
 * of steps as the value. */
static int newton_unsolved(const System *system, MildScratch *scratch, const Point *best,
                           MildContactResult *result, int n, int parts) {
    Point safe = {.residual = INFINITY}, found = *best;
    safe.twist = system->free;
    bounds_begin(scratch, 0.0);
    int steps = newton_held(system, scratch, &safe, NEWTON_ROUND, n, parts);
    contact_pass(scratch, system->dt, safe.twist.at, system->first);
    bounds_begin(scratch, 1.0);
    steps += newton_held(system, scratch, &safe, NEWTON_ROUND, n, parts);
    const Row safe_twist = safe.twist;
    point_return(system, scratch, &safe, n, parts);
    contact_pass(scratch, system->dt, best->twist.at, system->first);
    point_return(system, scratch, &found, n, parts);
    if (found.residual <= safe.residual) {
        contact_pass(scratch, system->dt, best->twist.at, system->first);
    } else {
        contact_pass_held(scratch, system->dt, safe_twist.at, system->first);
    }
    result->residual = fmin(found.residual, safe.residual);
    return steps;
}

/* Solves for the n rows from `first` on. */
ALWAYS_INLINE void system_solve(MildScratch *scratch, const MildContactInput *input, int first,
                                MildContactResult *result, int n, int parts) {
    System opened, *system = &opened;
    Point best = {.residual = INFINITY};
    system_open(system, scratch, input, first, n, parts);
    row_load(&best.twist, input->velocity[first / 6], n, parts);
    contact_pass(scratch, system->dt, best.twist.at, system->first);
    int steps = newton_plain(system, scratch, &best, least(system->limit, NEWTON_PLAIN), n, parts);
    result->converged = point_solves(system, &best, n, parts);
    if (!result->converged) {
        steps += newton_patient(system, scratch, &best, system->limit - steps, n, parts);
        contact_pass(scratch, system->dt, best.twist.at, system->first);
        result->converged = point_solves(system, &best, n, parts);
    }
    double scale = system_norm(system, best.impulse.at, n, parts);
    result->residual = scale > 0.0 ? best.residual / scale : best.residual;
    if (!result->converged) {
        steps += newton_unsolved(system, scratch, &best, result, n, parts);
    }
    result->iterations = steps;
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
    memset(scratch->wrench, 0, sizeof scratch->wrench);
    for (int f = first; f < end && n > 12; f++) { /* clear feet in the air between loaded ones */
        if (scratch->foot[f].active == 0) {
            memset(scratch->hessian[f], 0, sizeof scratch->hessian[f]);
        }
    }
    if (n == 6) {
        system_solve(scratch, input, 6 * first, result, 6, 1);
    } else if (n == 12) {
        system_solve(scratch, input, 6 * first, result, 12, 2);
    } else {
        system_solve(scratch, input, 6 * first, result, n, NEWTON_VECTORS);
    }
    for (int i = 0; i < stride; i++) {
        double sum = input->free_velocity[i];
        for (int j = 6 * first; j < 6 * end; j++) {
            sum += input->inverse_inertia[i * stride + j] * scratch->wrench[j];
        }
        result->velocity[i] = sum;
    }
}
