#include "lab/fit.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/student.h"

/* [-] Relative step of the central differences, which are exact where F is linear. */
#define FIT_DIFFERENCE 1e-5
/* [-] A column whose own part is below this share of it is a combination of the others. */
#define FIT_DEPENDENT 1e-5
#define FIT_CORRELATION 0.95
/* [-] A correlated parameter with a larger relative half width counts as undetermined. */
#define FIT_LOOSE 0.25
/* [-] Smallest ratio of speeds that determines drag. */
#define FIT_SPEEDS 1.3

enum { P = FIT_PARAMETERS, FIT_ITERATIONS = 100, FIT_STARTS = 5, LOCAL_ROWS = 200 };

const char *const fit_names[FIT_PARAMETERS] = {"k_pen", "sigma_cone", "alpha", "nu", "c_g", "c_d"};

/* The order in which parameters are given up when several have the same effect. */
static const FitName give_up[FIT_PARAMETERS] = {FIT_NU,  FIT_ALPHA,      FIT_C_G,
                                                FIT_C_D, FIT_SIGMA_CONE, FIT_K_PEN};

/* The working arrays of one run. */
typedef struct {
    FitDef def; /* its material is the present estimate */
    const FitPoint *points;
    int count;
    double *miss;   /* [count] [N] measured minus computed force */
    double *column; /* [P][count] dF/dparameter; those of held ones unused */
    double *own; /* [P][count] the part of a column that is orthogonal to the other free columns */
    double *leverage;    /* [count] influence of a row on its own fitted value, 0 .. 1 */
    double *basis;       /* [P][count] for orthogonalisation */
    double own_share[P]; /* |own| over |column| */
} Fit;

double *fit_value(MildMaterial *material, FitName name) {
    double *const values[P] = {&material->k_pen, &material->sigma_cone, &material->alpha,
                               &material->nu,    &material->c_g,        &material->c_d};
    return values[name];
}

void fit_range(const MildMaterial *material, FitName name, double *low, double *high) {
    const MildField *field =
        mild_field_find(mild_material_fields, mild_material_field_count, fit_names[name], NULL);
    *low = field->min;
    if (material->passive && name == FIT_C_D) {
        *low = 0.5;
    }
    if (material->passive && name == FIT_C_G) {
        *low = 0;
    }
    *high = field->max;
}

static double drag_scale(const MildMaterial *material) {
    return material->passive ? fmax(material->c_d, 0.5) : material->c_d;
}

double fit_force(const FitDef *def, const FitPoint *point) {
    MildElementLaw law = mild_element_law(&def->material, def->pitch, fmax(point->depth, 0));
    double drag =
        drag_scale(&def->material) * law.added_mass_per_depth * point->speed * point->speed;
    return def->elements * (law.force + drag + law.added_mass * point->acceleration);
}

int fit_loading(FitPoint *points, int count) {
    int kept = 0;
    double deepest = DBL_MIN; /* at depth 0 the law gives no information */
    for (int i = 0; i < count; i++) {
        if (!(points[i].depth >= deepest)) {
            continue;
        }
        deepest = points[i].depth;
        points[kept++] = points[i];
    }
    return kept;
}

static double fit_miss(Fit *fit) {
    double sum = 0;
    for (int i = 0; i < fit->count; i++) {
        const FitPoint *point = &fit->points[i];
        fit->miss[i] = point->force - fit_force(&fit->def, point);
        sum += fit->miss[i] * fit->miss[i];
    }
    return sum;
}

static void fit_columns(Fit *fit) {
    for (int p = 0; p < P; p++) {
        if (!fit->def.free[p]) {
            continue;
        }
        double *value = fit_value(&fit->def.material, (FitName)p), centre = *value, low, high;
        fit_range(&fit->def.material, (FitName)p, &low, &high);
        double step = FIT_DIFFERENCE * fmax(fabs(centre), 1e-3 * (high - low));
        double up = fmin(centre + step, high), down = fmax(centre - step, low),
               *column = fit->column + p * fit->count;
        *value = up;
        for (int i = 0; i < fit->count; i++) {
            column[i] = fit_force(&fit->def, &fit->points[i]);
        }
        *value = down;
        for (int i = 0; i < fit->count; i++) {
            column[i] -= fit_force(&fit->def, &fit->points[i]);
            column[i] /= up - down;
        }
        *value = centre;
    }
}

static double dot(const double *a, const double *b, int count) {
    double sum = 0;
    for (int i = 0; i < count; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* Inverse of the n x n positive definite `a` (stride P) by Gauss-Jordan; 0 when it is singular. */
static int invert(double a[P][P], int n, double inverse[P][P]) {
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            inverse[i][j] = i == j;
        }
    }
    for (int k = 0; k < n; k++) {
        if (!(a[k][k] > 1e-14)) {
            return 0;
        }
        double pivot = 1 / a[k][k];
        for (int j = 0; j < n; j++) {
            a[k][j] *= pivot;
            inverse[k][j] *= pivot;
        }
        for (int i = 0; i < n; i++) {
            double factor = a[i][k];
            for (int j = 0; j < n && i != k; j++) {
                a[i][j] -= factor * a[k][j];
                inverse[i][j] -= factor * inverse[k][j];
            }
        }
    }
    return 1;
}

/* Speed and acceleration of row `i` from a least-squares polynomial through the depths around it.
 * It is a quartic through a twentieth of the rows, because a decelerating plate needs its small
 * bias, or a parabola when there are few rows. Both are 0 when the times are missing. At most
 * LOCAL_ROWS rows of the window are used, so that the cost grows only with the length of the
 * record. */
static void local_motion(const FitPoint *points, int count, int i, double *speed,
                         double *acceleration) {
    int half = count / 40 > 4 ? count / 40 : 4, rows = 2 * half + 1 < count ? 2 * half + 1 : count;
    int first = i - half > 0 ? (i + half < count ? i - half : count - rows) : 0,
        stride = 1 + rows / LOCAL_ROWS;
    int terms = rows >= 15 ? 5 : 3;
    double now = points[i].time,
           reach = fmax(now - points[first].time, points[first + rows - 1].time - now);
    double moment[2 * P] = {0}, depth[P] = {0}, normal[P][P], inverse[P][P];
    for (int k = first; k < first + rows; k += stride) {
        double t = (points[k].time - now) / reach, power = 1;
        for (int n = 0; n < 2 * terms - 1; n++, power *= t) {
            moment[n] += power / rows;
            if (n < terms) {
                depth[n] += power * (points[k].depth - points[i].depth) / rows;
            }
        }
    }
    *speed = *acceleration = 0;
    for (int a = 0; a < terms; a++) {
        for (int b = 0; b < terms; b++) {
            normal[a][b] = moment[a + b];
        }
    }
    if (!(reach > 0) || !invert(normal, terms, inverse)) {
        return;
    }
    for (int a = 0; a < terms; a++) {
        *speed += inverse[1][a] * depth[a] / reach;
        *acceleration += 2 * inverse[2][a] * depth[a] / (reach * reach);
    }
    *speed = fmax(*speed, 0);
}

void fit_speeds(FitPoint *points, int count) {
    for (int i = 0; i < count; i++) {
        double speed;
        local_motion(points, count, i, &speed, &points[i].acceleration);
        if (!isfinite(points[i].speed)) {
            points[i].speed = speed;
        }
    }
}

/* The free parameters that may move, which excludes those that the gradient pushes against a
 * bound. */
static int movable(const Fit *fit, int names[P]) {
    MildMaterial material = fit->def.material;
    int n = 0;
    for (int p = 0; p < P; p++) {
        double low, high, value = *fit_value(&material, (FitName)p);
        if (!fit->def.free[p]) {
            continue;
        }
        fit_range(&material, (FitName)p, &low, &high);
        double pull = dot(fit->column + p * fit->count, fit->miss, fit->count);
        if ((value <= low && pull < 0) || (value >= high && pull > 0)) {
            continue;
        }
        names[n++] = p;
    }
    return n;
}

/* One damped step, (J'J + lambda diag) x = J'r with columns scaled to length 1, clipped to the
 * bounds. */
static void fit_step(Fit *fit, const int names[P], int n, double lambda) {
    double normal[P][P], inverse[P][P], length[P];
    const double *column[P];
    for (int a = 0; a < n; a++) {
        column[a] = fit->column + names[a] * fit->count;
        length[a] = sqrt(dot(column[a], column[a], fit->count)) + DBL_MIN;
    }
    for (int a = 0; a < n; a++) {
        for (int b = 0; b < n; b++) {
            normal[a][b] =
                dot(column[a], column[b], fit->count) / (length[a] * length[b]) + (a == b) * lambda;
        }
    }
    if (!invert(normal, n, inverse)) {
        return;
    }
    for (int a = 0; a < n; a++) {
        double move = 0, low, high, *value = fit_value(&fit->def.material, (FitName)names[a]);
        for (int b = 0; b < n; b++) {
            move += inverse[a][b] * dot(column[b], fit->miss, fit->count) / length[b];
        }
        fit_range(&fit->def.material, (FitName)names[a], &low, &high);
        *value = fmin(fmax(*value + move / length[a], low), high);
    }
}

/* Levenberg-Marquardt from the present estimate; returns the sum of squares. */
static double fit_descend(Fit *fit) {
    double lambda = 1e-6, best = fit_miss(fit);
    for (int iteration = 0; iteration < FIT_ITERATIONS && lambda < 1e8; iteration++) {
        int names[P];
        fit_columns(fit);
        int n = movable(fit, names);
        MildMaterial before = fit->def.material;
        double sum = best;
        for (; n > 0 && lambda < 1e8; lambda *= 10) {
            fit_step(fit, names, n, lambda);
            sum = fit_miss(fit);
            if (sum < best) {
                break;
            }
            fit->def.material = before;
            fit_miss(fit);
        }
        int done = !(sum < best * (1 - 1e-12));
        best = fmin(sum, best);
        lambda = fmax(lambda * 0.1, 1e-14);
        if (done) {
            break;
        }
    }
    return best;
}

/* Least squares from several starts, because the sum of squares may have several minima in the
 * shape u_f. */
static double fit_solve(Fit *fit) {
    static const double alphas[FIT_STARTS] = {0, 0.5, 0.9, 1.25, 1.45},
                        nus[FIT_STARTS] = {0, 0.4, 1, 2.5, 6};
    MildMaterial start = fit->def.material, found = start;
    double least = INFINITY;
    int shape = fit->def.free[FIT_ALPHA] || fit->def.free[FIT_NU];
    for (int s = 0; s < (shape ? FIT_STARTS : 1); s++) {
        fit->def.material = start;
        if (s && fit->def.free[FIT_ALPHA]) {
            fit->def.material.alpha = alphas[s];
        } else if (s) {
            fit->def.material.nu = nus[s];
        }
        double sum = fit_descend(fit);
        if (!(sum < least)) {
            continue;
        }
        least = sum;
        found = fit->def.material;
    }
    fit->def.material = found;
    fit_columns(fit);
    return fit_miss(fit);
}

/* Projects the directions of basis[0..n) out of `vector`, twice to remove rounding errors. */
static void project_out(const Fit *fit, int n, double *vector) {
    for (int k = 0; k < 2 * n; k++) {
        const double *direction = fit->basis + k % n * fit->count;
        double along = dot(direction, vector, fit->count);
        for (int i = 0; i < fit->count; i++) {
            vector[i] -= along * direction[i];
        }
    }
}

/* The own part of column p is orthogonal to all other free columns. own/|own|^2 is p's row of the
 * pseudoinverse of J, which gives the covariance of the estimates without inverting J'J. */
static void own_part(Fit *fit, int p) {
    int n = 0, count = fit->count;
    size_t bytes = sizeof(double) * (size_t)count;
    for (int q = 0; q < P; q++) {
        if (q == p || !fit->def.free[q]) {
            continue;
        }
        double *vector = fit->basis + n * count, *column = fit->column + q * count;
        memcpy(vector, column, bytes);
        if (n) {
            project_out(fit, n, vector);
        }
        double length = sqrt(dot(vector, vector, count));
        if (!(length > FIT_DEPENDENT * sqrt(dot(column, column, count)))) {
            continue;
        }
        for (int i = 0; i < count; i++) {
            vector[i] /= length;
        }
        n++;
    }
    double *own = fit->own + p * count, *column = fit->column + p * count;
    memcpy(own, column, bytes);
    if (n) {
        project_out(fit, n, own);
    }
    double square = dot(own, own, count) + DBL_MIN;
    for (int i = 0; i < count; i++) { /* basis and own part together span all columns, for any p */
        fit->leverage[i] = own[i] * own[i] / square;
        for (int k = 0; k < n; k++) {
            fit->leverage[i] += fit->basis[k * count + i] * fit->basis[k * count + i];
        }
    }
    fit->own_share[p] = sqrt(dot(own, own, count) / (dot(column, column, count) + DBL_MIN));
}

static double own_correlation(const Fit *fit, int p, int q) {
    const double *a = fit->own + p * fit->count, *b = fit->own + q * fit->count;
    return dot(a, b, fit->count) / sqrt(dot(a, a, fit->count) * dot(b, b, fit->count));
}

/* Half of the 95 % interval. Rows may differ in noise: variance = sum (g r/(1 - h))^2 with
 * g = own/|own|^2 and the leverage h of each row, "HC3" of MacKinnon and White 1985. */
static double half_width(const Fit *fit, int p, int free) {
    const double *own = fit->own + p * fit->count;
    double sum = 0;
    for (int i = 0; i < fit->count; i++) {
        double share = own[i] * fit->miss[i] / fmax(1 - fit->leverage[i], 1e-3);
        sum += share * share;
    }
    return student_95(fit->count - free) * sqrt(sum) / dot(own, own, fit->count);
}

/* The scale that a half width is compared with, which is the value itself. For sigma_cone, which
 * may be 0, it is at least the sigma_cone of a straight law. */
static double typical(const Fit *fit, int p) {
    MildMaterial material = fit->def.material;
    double value = fabs(*fit_value(&material, (FitName)p));
    double straight = material.k_pen * cos(material.alpha) / (fit->def.pitch * fit->def.pitch);
    return p == FIT_SIGMA_CONE ? fmax(value, straight) : value;
}

/* The state of the free parameter p: FIT_FITTED when the data determine it. */
static FitParameter judge(const Fit *fit, int p, int free) {
    FitParameter verdict = {.state = FIT_FITTED, .low = NAN, .high = NAN};
    const double *column = fit->column + p * fit->count;
    double low, high, force = 0;
    fit_range(&fit->def.material, (FitName)p, &low, &high);
    for (int i = 0; i < fit->count; i++) {
        force += fit->points[i].force * fit->points[i].force;
    }
    if (!(sqrt(dot(column, column, fit->count)) * (high - low) > 1e-9 * sqrt(force))) {
        verdict.state = FIT_NO_EFFECT;
        return verdict;
    }
    for (int k = P - 1; k >= 0 && fit->own_share[p] < FIT_DEPENDENT; k--) {
        FitName q = give_up[k];
        if (!fit->def.free[q] || (int)q == p || fit->own_share[q] >= FIT_DEPENDENT) {
            continue;
        }
        verdict.state = FIT_TIED;
        verdict.partner = q;
        verdict.correlation = 1;
    }
    if (verdict.state == FIT_TIED) {
        return verdict;
    }
    double half = half_width(fit, p, free), strongest = FIT_CORRELATION;
    for (int q = 0; q < P; q++) {
        if (!fit->def.free[q] || q == p) {
            continue;
        }
        double correlation = own_correlation(fit, p, q);
        int loose = half > FIT_LOOSE * typical(fit, p) ||
                    half_width(fit, q, free) > FIT_LOOSE * typical(fit, q);
        if (!loose || !(fabs(correlation) > strongest)) {
            continue;
        }
        strongest = fabs(correlation);
        verdict =
            (FitParameter){.state = FIT_TIED, .partner = (FitName)q, .correlation = correlation};
    }
    if (verdict.state == FIT_FITTED && !(2 * half <= 0.5 * (high - low))) {
        verdict.state = FIT_WIDE;
    }
    MildMaterial material = fit->def.material;
    verdict.value = *fit_value(&material, (FitName)p);
    verdict.low = fmax(verdict.value - half, low);
    verdict.high = fmin(verdict.value + half, high);
    return verdict;
}

static int free_count(const Fit *fit) {
    int free = 0;
    for (int p = 0; p < P; p++) {
        free += fit->def.free[p] != 0;
    }
    return free;
}

static void hold(Fit *fit, const FitDef *def, FitName name, FitParameter *parameter,
                 const FitParameter *why) {
    MildMaterial given = def->material;
    fit->def.free[name] = 0;
    *parameter = *why;
    parameter->low = parameter->high = NAN;
    *fit_value(&fit->def.material, name) = *fit_value(&given, name);
}

/* Fits, holds the parameter that the data determine least, and fits again, until the data determine
 * all that are left. nu is held first, because that resolves the only exact degeneracy of the law
 * (sigma_cone, alpha, nu, and c_d with drag). */
static double fit_reduce(Fit *fit, const FitDef *def, FitResult *result) {
    static const FitState order[] = {FIT_NO_EFFECT, FIT_TIED, FIT_WIDE};
    for (int free = free_count(fit); free > 0; free = free_count(fit)) {
        int given_up = 0;
        double sum = fit_solve(fit);
        for (int p = 0; p < P; p++) {
            if (fit->def.free[p]) {
                own_part(fit, p);
            }
        }
        for (int p = 0; p < P; p++) {
            if (fit->def.free[p]) {
                result->parameter[p] = judge(fit, p, free);
            }
        }
        for (int o = 0; o < 3 && !given_up; o++) {
            for (int k = 0; k < P && !given_up; k++) {
                FitParameter verdict = result->parameter[give_up[k]];
                if (!fit->def.free[give_up[k]] || verdict.state != order[o]) {
                    continue;
                }
                hold(fit, def, give_up[k], &result->parameter[give_up[k]], &verdict);
                given_up = 1;
            }
        }
        if (!given_up) {
            return sum;
        }
    }
    return fit_miss(fit);
}

/* c_d, and c_g with it, need rows of different speed and a ground with added mass. */
static void hold_drag(Fit *fit, const FitDef *def, FitResult *result) {
    static const FitName rate[] = {FIT_C_D, FIT_C_G};
    const MildMaterial *m = &def->material;
    double slowest = INFINITY, fastest = 0, added = m->passive ? fmax(m->c_g, 0) : m->c_g;
    for (int i = 0; i < fit->count; i++) {
        slowest = fmin(slowest, fit->points[i].speed);
        fastest = fmax(fastest, fit->points[i].speed);
    }
    int same = fastest <= FIT_SPEEDS * slowest, massless = added == 0 && !def->free[FIT_C_G];
    for (int k = 0; k < 2; k++) {
        FitParameter why = {.state = massless ? FIT_NO_MASS : FIT_NO_SPEEDS};
        if (def->free[rate[k]] && (same || massless)) {
            hold(fit, def, rate[k], &result->parameter[rate[k]], &why);
        }
    }
}

static MildStatus fit_check(const FitDef *def, const FitPoint *points, int count,
                            MildError *error) {
    MildStatus status = mild_material_check(&def->material, error);
    if (status != MILD_OK) {
        return status;
    }
    if (count < FIT_POINTS_MIN) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "fit: %d loading rows, at least %d are needed",
                         count, FIT_POINTS_MIN);
    }
    if (def->elements < 1 || !(def->pitch > 0)) {
        return mild_fail(error, MILD_ERROR_RANGE, "fit: the plate has no element");
    }
    for (int i = 0; i < count; i++) {
        if (isfinite(points[i].depth) && isfinite(points[i].force) && isfinite(points[i].speed) &&
            isfinite(points[i].acceleration)) {
            continue;
        }
        return mild_fail(error, MILD_ERROR_RANGE, "fit: row %d is not finite", i + 1);
    }
    return MILD_OK;
}

MildStatus fit_run(const FitDef *def, const FitPoint *points, int count, FitResult *result,
                   MildError *error) {
    MildStatus status = fit_check(def, points, count, error);
    if (status != MILD_OK) {
        return status;
    }
    size_t rows = (size_t)count;
    double *block = malloc(sizeof *block * rows * (3 * P + 2));
    if (!block) {
        return mild_fail(error, MILD_ERROR_MEMORY, "fit: out of memory");
    }
    Fit fit = {
        .def = *def, .points = points, .count = count, .miss = block, .column = block + rows};
    fit.own = fit.column + P * rows;
    fit.basis = fit.own + P * rows;
    fit.leverage = fit.basis + P * rows;
    *result = (FitResult){.points = count};
    for (int p = 0; p < P; p++) {
        result->parameter[p] = (FitParameter){.low = NAN, .high = NAN};
    }
    for (int p = 0; p < P; p++) { /* start within the bounds, because passive grounds clamp c_d */
        double low, high, *value = fit_value(&fit.def.material, (FitName)p);
        fit_range(&fit.def.material, (FitName)p, &low, &high);
        if (def->free[p]) {
            *value = fmin(fmax(*value, low), high);
        }
    }
    hold_drag(&fit, def, result);
    double sum = fit_reduce(&fit, def, result), force = 0;
    for (int i = 0; i < count; i++) {
        force += points[i].force * points[i].force;
    }
    result->material = fit.def.material;
    for (int p = 0; p < P; p++) {
        result->parameter[p].value = *fit_value(&result->material, (FitName)p);
    }
    result->residual = sqrt(sum / count);
    result->residual_share = force > 0 ? sqrt(sum / force) : 0;
    free(block);
    return MILD_OK;
}
