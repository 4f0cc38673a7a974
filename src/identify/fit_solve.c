#include "identify/fit_solve.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/student.h"

/* [-] Relative step of the central differences, which are exact where F is linear. */
#define FIT_DIFFERENCE 1e-5
/* [-] Error of one row that is assumed at least, as a share of the root mean square force. */
#define FIT_FLOOR 1e-4
/* [-] The end of an interval is found within this share of its half width. */
#define FIT_END 2e-3

#define FIT_BOUND 0.1 /* [-] */
#define FIT_OTHERS 8  /* [rows] of the noise of all */

enum { FIT_ITERATIONS = 100, FIT_STARTS = 5, FIT_END_STEPS = 60 };

_Static_assert((int)FIT_PARAMETERS_MAX <= (int)INVERSE_MAX, "the normal equations fit");

int fit_open(Fit *fit, int parameters) {
    const size_t rows = (size_t)fit->count, columns = (size_t)parameters;
    fit->miss = malloc(sizeof *fit->miss * rows * (4 + 2 * columns));
    if (!fit->miss) {
        return 0;
    }
    fit->own = fit->miss + rows;
    fit->leverage = fit->own + rows;
    fit->residual = fit->leverage + rows;
    fit->column = fit->residual + rows;
    fit->basis = fit->column + columns * rows;
    return 1;
}

void fit_close(Fit *fit) {
    free(fit->miss);
}

/* ---- coordinates ---- */

MildMaterial fit_material(const Fit *fit) {
    MildMaterial material = fit->base;
    for (int i = 0; i < fit->coordinates; i++) {
        *fit_number(&material, fit->coordinate[i].field) = fit->value[i];
    }
    for (int i = 0; i < 2 * fit->coordinates; i++) { /* what needs others comes last */
        const int p = i % fit->coordinates;
        const FitCombination *combination = fit->coordinate[p].combination;
        if (combination && combination->last == i / fit->coordinates) {
            combination->set(&material, fit->value[p]);
        }
    }
    return material;
}

void fit_start(Fit *fit, const MildMaterial *material) {
    MildMaterial from = *material;
    for (int i = 0; i < fit->coordinates; i++) {
        const FitCoordinate *c = &fit->coordinate[i];
        const double value =
            c->combination ? c->combination->get(material) : *fit_number(&from, c->field);
        fit->value[i] = fmin(fmax(value, c->low), c->high);
    }
}

/* ---- sums and columns ---- */

static double dot(const double *a, const double *b, int count) {
    double sum = 0;
    for (int i = 0; i < count; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

static void forces(const Fit *fit, double *force) {
    const MildMaterial material = fit_material(fit);
    fit_forces(fit->kind, fit->plates, &material, fit->points, fit->count, force);
}

static double fit_miss(Fit *fit) {
    forces(fit, fit->miss);
    for (int i = 0; i < fit->count; i++) {
        fit->miss[i] = fit->points[i].force - fit->miss[i];
    }
    return dot(fit->miss, fit->miss, fit->count);
}

void fit_columns(Fit *fit) {
    double *other = fit->own;
    for (int p = 0; p < fit->coordinates; p++) {
        const FitCoordinate *c = &fit->coordinate[p];
        double *column = fit->column + p * fit->count;
        if (p == fit->fixed) {
            continue;
        }
        const double centre = fit->value[p];
        const double step = FIT_DIFFERENCE * fmax(fabs(centre), 1e-3 * (c->high - c->low));
        const double up = fmin(centre + step, c->high), down = fmax(centre - step, c->low);
        fit->value[p] = up;
        forces(fit, column);
        fit->value[p] = down;
        forces(fit, other);
        fit->value[p] = centre;
        for (int i = 0; i < fit->count; i++) {
            column[i] = (column[i] - other[i]) / (up - down);
        }
    }
}

/* ---- the minimum ---- */

/* The coordinates that may move, which excludes those that the gradient pushes against a bound. */
static int movable(const Fit *fit, int names[FIT_PARAMETERS_MAX]) {
    int n = 0;
    for (int p = 0; p < fit->coordinates; p++) {
        const FitCoordinate *c = &fit->coordinate[p];
        const double pull = dot(fit->column + p * fit->count, fit->miss, fit->count);
        const int held = (fit->value[p] <= c->low && pull < 0) ||
                         (fit->value[p] >= c->high && pull > 0) || p == fit->fixed;
        if (!held) {
            names[n++] = p;
        }
    }
    return n;
}

/* One damped step, (J'J + lambda diag) x = J'r with columns scaled to length 1, clipped to the
 * bounds. `square` is J'J and `pull` J'r of all coordinates. */
static void fit_step(Fit *fit, const int names[FIT_PARAMETERS_MAX], int n, double lambda,
                     double square[INVERSE_MAX][INVERSE_MAX], const double *pull) {
    double normal[INVERSE_MAX][INVERSE_MAX], inverse[INVERSE_MAX][INVERSE_MAX];
    double length[FIT_PARAMETERS_MAX];
    for (int a = 0; a < n; a++) {
        length[a] = sqrt(square[names[a]][names[a]]);
        length[a] += length[a] == 0; /* without effect here; damping keeps it where it is */
    }
    for (int a = 0; a < n; a++) {
        for (int b = 0; b < n; b++) {
            normal[a][b] = square[names[a]][names[b]] / (length[a] * length[b]) + (a == b) * lambda;
        }
    }
    if (!inverse_find(normal, n, inverse)) {
        return;
    }
    for (int a = 0; a < n; a++) {
        const FitCoordinate *c = &fit->coordinate[names[a]];
        double move = 0, *value = &fit->value[names[a]];
        for (int b = 0; b < n; b++) {
            move += inverse[a][b] * pull[names[b]] / length[b];
        }
        *value = fmin(fmax(*value + move / length[a], c->low), c->high);
    }
}

/* Levenberg-Marquardt from the present estimate; returns the sum of squares. */
static double fit_descend(Fit *fit) {
    double lambda = 1e-6, best = fit_miss(fit);
    for (int iteration = 0; iteration < FIT_ITERATIONS && lambda < 1e8; iteration++) {
        int names[FIT_PARAMETERS_MAX];
        double before[FIT_PARAMETERS_MAX], pull[FIT_PARAMETERS_MAX];
        double square[INVERSE_MAX][INVERSE_MAX], sum = best;
        fit_columns(fit);
        for (int a = 0; a < fit->coordinates; a++) {
            const double *column = fit->column + a * fit->count;
            pull[a] = dot(column, fit->miss, fit->count);
            for (int b = 0; b <= a; b++) {
                square[a][b] = square[b][a] = dot(column, fit->column + b * fit->count, fit->count);
            }
        }
        const int n = movable(fit, names);
        memcpy(before, fit->value, sizeof before);
        for (; n > 0 && lambda < 1e8; lambda *= 10) {
            fit_step(fit, names, n, lambda, square, pull);
            sum = fit_miss(fit);
            if (sum < best) {
                break;
            }
            memcpy(fit->value, before, sizeof before);
        }
        const int done = !(sum < best * (1 - 1e-9));
        best = fmin(sum, best);
        lambda = fmax(lambda * 0.1, 1e-14);
        if (done) {
            break;
        }
    }
    return best;
}

static int coordinate_find(const Fit *fit, const char *name) {
    for (int p = 0; p < fit->coordinates; p++) {
        if (strcmp(fit->coordinate[p].field->name, name) == 0) {
            return p;
        }
    }
    return -1;
}

/* The coordinate that shapes the curve: the sum of squares may have several minima in it. */
static int shape_find(const Fit *fit) {
    static const char *const shapes[] = {"nu",           "alpha",    "exponent",
                                         "shear_length", "recovery", "slip_length"};
    for (size_t s = 0; s < sizeof shapes / sizeof *shapes; s++) {
        const int p = coordinate_find(fit, shapes[s]);
        if (p >= 0) {
            return p;
        }
    }
    return -1;
}

/* ---- own parts and leverage ---- */

/* Projects the directions of basis[0..n) out of `vector`, twice to remove rounding errors. */
static void project_out(const Fit *fit, int n, double *vector) {
    for (int k = 0; k < 2 * n; k++) {
        const double *direction = fit->basis + k % n * fit->count;
        const double along = dot(direction, vector, fit->count);
        for (int i = 0; i < fit->count; i++) {
            vector[i] -= along * direction[i];
        }
    }
}

/* The own part of a column is orthogonal to all other columns. own/|own|^2 is its row of the
 * pseudoinverse of J. */
double fit_own(Fit *fit, int coordinate) {
    const int count = fit->count;
    const double *column = fit->column + coordinate * count;
    int n = 0;
    for (int q = 0; q < fit->coordinates; q++) {
        double *vector = fit->basis + n * count;
        if (q == coordinate) {
            continue;
        }
        memcpy(vector, fit->column + q * count, sizeof *vector * (size_t)count);
        const double whole = sqrt(dot(vector, vector, count));
        if (n) {
            project_out(fit, n, vector);
        }
        const double length = sqrt(dot(vector, vector, count));
        if (!(length > FIT_DEPENDENT * whole)) {
            continue;
        }
        for (int i = 0; i < count; i++) {
            vector[i] /= length;
        }
        n++;
    }
    memcpy(fit->own, column, sizeof *column * (size_t)count);
    if (n) {
        project_out(fit, n, fit->own);
    }
    const double square = dot(fit->own, fit->own, count) + DBL_MIN;
    for (int i = 0; i < count; i++) { /* basis and own part together span all columns */
        fit->leverage[i] = fit->own[i] * fit->own[i] / square;
        for (int k = 0; k < n; k++) {
            fit->leverage[i] += fit->basis[k * count + i] * fit->basis[k * count + i];
        }
    }
    return sqrt(dot(fit->own, fit->own, count) / (dot(column, column, count) + DBL_MIN));
}

/* [N^2] The variance of a row that is assumed at least, because no sensor is exact. */
static double floor_variance(const Fit *fit) {
    double force = 0;
    for (int i = 0; i < fit->count; i++) {
        force += fit->points[i].force * fit->points[i].force;
    }
    return FIT_FLOOR * FIT_FLOOR * force / fit->count;
}

/* The correlation of neighbouring residuals. Independent errors have one of 1/sqrt(count) by
 * chance. Where it is clearly more, the law misses the curve or the noise is slow, and n rows count
 * as N = n (1 - c)/(1 + c). Each of k coordinates takes the slow part of one of them out of the
 * residuals, so c is more than theirs: c = (1 - k/N) seen + k/N. */
static void noise_find(Fit *fit) {
    double sum = 0, shrink = 0;
    for (int i = 0; i + 1 < fit->count; i++) {
        sum += fit->residual[i] * fit->residual[i + 1];
    }
    const double seen = fit->least > 0 ? sum / fit->least : 0;
    fit->neighbours = 0;
    fit->rows = fit->count;
    if (seen * sqrt(fit->count) <= 3 || fit->least <= floor_variance(fit) * fit->count) {
        return;
    }
    for (int i = 0; i < 50; i++) {
        fit->neighbours = fmin((1 - shrink) * seen + shrink, 0.999);
        fit->rows = fit->count * (1 - fit->neighbours) / (1 + fit->neighbours);
        shrink = fmin(fit->coordinates / fit->rows, 0.5);
    }
}

void fit_minimise(Fit *fit) {
    const int shape = shape_find(fit);
    /* of a slide: either mu or grip bounds friction at first */
    const int bound = coordinate_find(fit, "grip") >= 0 ? coordinate_find(fit, "mu") : -1;
    double start[FIT_PARAMETERS_MAX], found[FIT_PARAMETERS_MAX], least = INFINITY;
    memcpy(start, fit->value, sizeof start);
    memcpy(found, start, sizeof found);
    for (int s = 0; s < (shape >= 0 ? FIT_STARTS : 1); s++) {
        memcpy(fit->value, start, sizeof start);
        if (s) { /* at 1/5 .. 4/5 of its range, in ratios where that does not begin at 0 */
            const FitCoordinate *c = &fit->coordinate[shape];
            const double share = (double)s / FIT_STARTS;
            fit->value[shape] =
                c->low > 0 ? c->low * pow(c->high / c->low, share) : share * c->high;
        }
        if (bound >= 0 && s % 2) {
            fit->value[bound] = FIT_BOUND;
        }
        const double sum = fit_descend(fit);
        if (sum < least) {
            least = sum;
            memcpy(found, fit->value, sizeof found);
        }
    }
    memcpy(fit->value, found, sizeof found);
    fit->least = fit_miss(fit);
    memcpy(fit->residual, fit->miss, sizeof *fit->miss * (size_t)fit->count);
    noise_find(fit);
}

/* ---- intervals ---- */

/* The square of Student's t that bounds the interval. */
static double excess_allowed(const Fit *fit) {
    const double t = student_95((int)fmax(fit->rows - fit->coordinates, 1));
    return t * t;
}

/* The profile at one value of the fixed coordinate: the sum of squares, minimised over all others
 * from the present estimate, in excess of the least, over the variance of a row. Rows may differ in
 * noise: then that variance is the mean of (r/(1 - h))^2 with the leverage h, weighted by d^2,
 * where d is the change of a row's force from the minimum. Of a linear law this gives the interval
 * "HC3" of MacKinnon and White 1985. A curve may go through the few rows that know a coordinate,
 * which then say nothing about their noise; so FIT_OTHERS rows with that of all count beside them.
 */
static double profile(Fit *fit, double value) {
    double sum = 0, weight = DBL_MIN, squares = DBL_MIN;
    const double all = fit->least / fmax(fit->count - fit->coordinates, 1);
    fit->value[fit->fixed] = value;
    fit_descend(fit);
    const double excess = fit_miss(fit) - fit->least;
    for (int i = 0; i < fit->count; i++) {
        const double change = fit->residual[i] - fit->miss[i];
        const double miss = fit->residual[i] / fmax(1 - fit->leverage[i], 1e-3);
        sum += change * change * miss * miss;
        weight += change * change;
        squares += change * change * change * change;
    }
    const double know = weight * weight / squares; /* rows */
    const double own = sum / weight;
    const double variance = fmax(own, (know * own + FIT_OTHERS * all) / (know + FIT_OTHERS));
    const double freedom = fit->rows - fit->coordinates;
    const double each = fit->rows < fit->count ? fit->count / fmax(freedom, 1) : 1;
    return excess / (each * variance + floor_variance(fit) + DBL_MIN);
}

/* The end of the interval on the side of `limit`: the root of profile = allowed, sought in its
 * square root, which a linear law makes proportional to the distance from the minimum. Returns 0
 * when it met a lower sum of squares. */
static int interval_end(Fit *fit, double allowed, double guess, double limit, double *end,
                        int *open) {
    const double centre = fit->value[fit->fixed];
    double inside = 0, inside_root = 0, outside = limit - centre, outside_root = INFINITY;
    double last_gap = INFINITY;
    double estimate[FIT_PARAMETERS_MAX], step = copysign(fmin(guess, fabs(outside)), outside);
    memcpy(estimate, fit->value, sizeof estimate);
    *end = limit;
    *open = 1;
    for (int i = 0; i < FIT_END_STEPS && outside != 0; i++) {
        memcpy(fit->value, estimate, sizeof estimate);
        const double value = step == limit - centre ? limit : centre + step;
        const double share = profile(fit, value) / allowed;
        const double root = sqrt(fmax(share, 0));
        if (share < -FIT_END) {
            return 0;
        }
        if (root <= 1 && value == limit) {
            return 1;
        }
        if (root <= 1) {
            inside = step;
            inside_root = root;
            memcpy(estimate, fit->value, sizeof estimate);
        } else {
            outside = step;
            outside_root = root;
        }
        *end = value;
        if (fabs(root - 1) < FIT_END || fabs(outside - inside) < 1e-9 * fabs(outside)) {
            break;
        }
        if (isinf(outside_root)) { /* go on outward, as a linear law would */
            const double grown = inside * fmin(1.02 / fmax(inside_root, 0.1), 8);
            step = fabs(grown) < fabs(outside) ? grown : outside;
            continue;
        }
        const double gap = fabs(outside - inside),
                     secant = (1 - inside_root) / (outside_root - inside_root);
        const int slow = gap > 0.5 * last_gap; /* then halve the gap */
        step = inside + (outside - inside) * (slow ? 0.5 : fmin(fmax(secant, 0.02), 0.98));
        last_gap = slow ? INFINITY : gap;
    }
    *open = outside == 0;
    return 1;
}

int fit_interval(Fit *fit, int coordinate, FitInterval *interval) {
    const FitCoordinate *c = &fit->coordinate[coordinate];
    const double allowed = excess_allowed(fit);
    double estimate[FIT_PARAMETERS_MAX];
    memcpy(estimate, fit->value, sizeof estimate);
    fit_columns(fit);
    fit_own(fit, coordinate);
    const double variance = fit->least / fit->rows + floor_variance(fit);
    const double own = dot(fit->own, fit->own, fit->count) + DBL_MIN;
    const double guess = sqrt(allowed * variance / own) + DBL_MIN;
    fit->fixed = coordinate;
    int met = interval_end(fit, allowed, guess, c->low, &interval->low, &interval->open_low);
    if (met) {
        memcpy(fit->value, estimate, sizeof estimate);
        met = interval_end(fit, allowed, guess, c->high, &interval->high, &interval->open_high);
    }
    fit->fixed = -1;
    if (met) {
        memcpy(fit->value, estimate, sizeof estimate);
    }
    return met;
}
