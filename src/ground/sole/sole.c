#include "ground/sole/sole.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "ground/law/element_law.h"
#include "ground/sole/sole_inside.h"

/* ---- how far the cells of a plane raster are from the edge of the outline ---- */

typedef struct {
    double low[2];    /* [m] lower corner of the bounding box */
    double high[2];   /* [m] upper corner */
    double area;      /* [m^2] */
    double center[2]; /* [m] centroid */
} Outline;

#define EDGE_SAMPLES 4 /* points of a cell along each side */

/* Bool: the point is inside the outline. */
static int outline_inside(const MildSoleDef *def, double x, double y) {
    int inside = 0;
    for (int i = 0; i < def->points; i++) {
        const double *p = &def->outline[2 * i], *q = &def->outline[2 * ((i + 1) % def->points)];
        if ((p[1] > y) != (q[1] > y) && x < p[0] + (y - p[1]) / (q[1] - p[1]) * (q[0] - p[0])) {
            inside = !inside;
        }
    }
    return inside;
}

/* Distance of a point from edge i of the outline. */
static double edge_distance(const MildSoleDef *def, int i, double x, double y) {
    const double *p = &def->outline[2 * i], *q = &def->outline[2 * ((i + 1) % def->points)];
    const double ex = q[0] - p[0], ey = q[1] - p[1];
    const double square = ex * ex + ey * ey;
    const double along = square > 0.0 ? ((x - p[0]) * ex + (y - p[1]) * ey) / square : 0.0;
    const double t = fmin(fmax(along, 0.0), 1.0);
    return hypot(x - p[0] - t * ex, y - p[1] - t * ey);
}

/* Lists the edges that may be nearest to a point of the cell about (x, y). Returns their count. No
 * point is further from the centre than 0.71 edges of the cell. nearest: the distance of its
 * centre. */
static int edges_near(const MildSoleDef *def, double x, double y, int *near, double *nearest) {
    int count = 0;
    *nearest = INFINITY;
    for (int i = 0; i < def->points; i++) {
        *nearest = fmin(*nearest, edge_distance(def, i, x, y));
    }
    for (int i = 0; i < def->points; i++) {
        if (edge_distance(def, i, x, y) <= *nearest + 1.5 * def->pitch) {
            near[count++] = i;
        }
    }
    return count;
}

/* Mean and standard deviation over a cell, by points; 0 outside the outline. The distance changes
 * by the way itself, so the part of a cell that a point stands for has the variance of its own
 * edge. */
static void cell_edge(const MildSoleDef *def, double x, double y, int *near, double *mean,
                      double *spread) {
    const double part = def->pitch / EDGE_SAMPLES;
    double nearest, sum = 0.0, squares = 0.0;
    const int count = edges_near(def, x, y, near, &nearest);
    const int cut = nearest < 0.71 * def->pitch;
    for (int k = 0; k < EDGE_SAMPLES * EDGE_SAMPLES; k++) {
        const double sx = x + (k % EDGE_SAMPLES + 0.5) * part - 0.5 * def->pitch;
        const double sy = y + (k / EDGE_SAMPLES + 0.5) * part - 0.5 * def->pitch;
        if (!(cut ? outline_inside(def, sx, sy) : outline_inside(def, x, y))) {
            continue;
        }
        double distance = INFINITY;
        for (int n = 0; n < count; n++) {
            distance = fmin(distance, edge_distance(def, near[n], sx, sy));
        }
        sum += distance;
        squares += distance * distance + part * part / 12.0;
    }
    const int all = EDGE_SAMPLES * EDGE_SAMPLES;
    *mean = sum / all;
    *spread = sqrt(fmax(squares / all - *mean * *mean, 0.0));
}

/* [m] Mean over the outline, by cells of the sole's raster, in which the point (x, y) is a
 * centre. */
static double outline_mean(const MildSoleDef *def, const Outline *outline, double x, double y,
                           int *work) {
    const double pitch = def->pitch;
    double sum = 0.0, mean, spread;
    double cx = x - ceil((x - outline->low[0]) / pitch) * pitch;
    while (cx < outline->high[0] + pitch) {
        double cy = y - ceil((y - outline->low[1]) / pitch) * pitch;
        while (cy < outline->high[1] + pitch) {
            cell_edge(def, cx, cy, work, &mean, &spread);
            sum += mean * pitch * pitch;
            cy += pitch;
        }
        cx += pitch;
    }
    return sum / outline->area;
}

/* Mean and standard deviation of the distance from the edge over the n cells about (x, y) [m].
 * Cells cover more or less than the outline, and each counts whole: so the distances are scaled to
 * the mean over the outline. work: [points] scratch space. */
static void sole_edges(const MildSoleDef *def, const Outline *outline, int n, const double *x,
                       const double *y, double *edge, double *spread, int *work) {
    double sum = 0.0;
    for (int i = 0; i < n; i++) {
        cell_edge(def, x[i], y[i], work, &edge[i], &spread[i]);
        sum += edge[i] / n;
    }
    const double scale = outline_mean(def, outline, x[0], y[0], work) / sum;
    for (int i = 0; i < n && isfinite(scale); i++) {
        edge[i] *= scale;
        spread[i] *= scale;
    }
}

#define SOLE_POINTS_MAX 4096 /* limited because the search for crossing edges is quadratic in it */
#define RASTER_PHASES 16     /* raster offsets tried along each axis */
/* A pitch of its own: MATERIAL_PITCH times powers of this ratio are tried, so many of them. */
#define PITCH_RATIO 1.02
#define PITCH_COARSER 5
#define PITCH_FINER 35   /* to SOLE_PITCH_LEAST */
#define PITCH_LEVER 0.05 /* [-] by which its second moments may miss the outline's */

/* A raster of square cells with edge `pitch` that covers the outline. */
typedef struct {
    double origin[2]; /* [m] corner of the first cell */
    int columns;      /* along x */
    int rows;         /* along y */
} Raster;

static Outline outline_measure(const MildSoleDef *def) {
    Outline outline = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}, 0.0, {0.0, 0.0}};
    for (int i = 0; i < def->points; i++) {
        const double *p = &def->outline[2 * i], *q = &def->outline[2 * ((i + 1) % def->points)];
        double cross = p[0] * q[1] - q[0] * p[1];
        outline.area += 0.5 * cross;
        for (int k = 0; k < 2; k++) {
            outline.low[k] = fmin(outline.low[k], p[k]);
            outline.high[k] = fmax(outline.high[k], p[k]);
            outline.center[k] += (p[k] + q[k]) * cross / 6.0;
        }
    }
    outline.center[0] /= outline.area;
    outline.center[1] /= outline.area;
    outline.area = fabs(outline.area);
    return outline;
}

/* Twice the signed area of the triangle a b c: positive when c lies left of the line from a to
 * b. */
static double side(const double *a, const double *b, const double *c) {
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

static int edges_cross(const double *a, const double *b, const double *c, const double *d) {
    return side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0;
}

/* Checks each number on its own. */
static MildStatus numbers_check(const MildSoleDef *def, MildError *error) {
    if (!def->outline || def->points < 3) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "sole.points = %d: an outline needs at least 3 points", def->points);
    }
    if (def->points > SOLE_POINTS_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE, "sole.points = %d: at most %d", def->points,
                         SOLE_POINTS_MAX);
    }
    for (int i = 0; i < 2 * def->points; i++) {
        if (!isfinite(def->outline[i]) || fabs(def->outline[i]) > 10.0) {
            return mild_fail(error, MILD_ERROR_RANGE,
                             "sole.outline[%d] = %g is not within 10 m of the ankle", i / 2,
                             def->outline[i]);
        }
    }
    if (def->pitch != 0.0 && !(def->pitch >= 1e-3 && def->pitch <= 1.0)) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "sole.pitch = %g is outside 0.001 .. 1: [m] edge of an element, or 0",
                         def->pitch);
    }
    if (!isfinite(def->sole_z)) {
        return mild_fail(error, MILD_ERROR_RANGE, "sole.sole_z = %g is not finite", def->sole_z);
    }
    if (def->target_elements < 0 || def->target_elements > SOLE_ELEMENTS_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE, "sole.target_elements = %d is outside 0 .. %d",
                         def->target_elements, SOLE_ELEMENTS_MAX);
    }
    return MILD_OK;
}

/* Checks the outline as a whole. Its numbers have passed numbers_check. */
static MildStatus outline_check(const MildSoleDef *def, MildError *error) {
    for (int i = 0; i < def->points; i++) {
        for (int j = i + 1; j < def->points; j++) {
            if (edges_cross(&def->outline[2 * i], &def->outline[2 * ((i + 1) % def->points)],
                            &def->outline[2 * j], &def->outline[2 * ((j + 1) % def->points)])) {
                return mild_fail(error, MILD_ERROR_ARGUMENT,
                                 "sole.outline crosses itself: edges %d and %d", i, j);
            }
        }
    }
    Outline outline = outline_measure(def);
    if (!(outline.area > 0.0)) {
        return mild_fail(error, MILD_ERROR_RANGE, "sole.outline encloses no area");
    }
    double cells = ((outline.high[0] - outline.low[0]) / def->pitch + 2.0) *
                   ((outline.high[1] - outline.low[1]) / def->pitch + 2.0);
    if (cells > SOLE_ELEMENTS_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE, "sole.pitch = %g makes %.0f cells, at most %d",
                         def->pitch, cells, SOLE_ELEMENTS_MAX);
    }
    return MILD_OK;
}

/* Clips a polygon against a half plane (Sutherland-Hodgman): keeps the part where sign * (p[axis] -
 * bound) >= 0. `out` must have room for twice `count` points. Returns the number of points kept. */
static int clip_half(const double *in, int count, double *out, int axis, double bound,
                     double sign) {
    int kept = 0;
    for (int i = 0; i < count; i++) {
        const double *p = &in[2 * i], *q = &in[2 * ((i + 1) % count)];
        double dp = sign * (p[axis] - bound), dq = sign * (q[axis] - bound);
        if (dp >= 0.0) {
            memcpy(&out[2 * kept++], p, 2 * sizeof *p);
        }
        if ((dp > 0.0 && dq < 0.0) || (dp < 0.0 && dq > 0.0)) {
            double t = dp / (dp - dq);
            for (int k = 0; k < 2; k++) {
                out[2 * kept + k] = p[k] + t * (q[k] - p[k]);
            }
            out[2 * kept++ + axis] = bound;
        }
    }
    return kept;
}

/* Share of a cell that the outline covers, 0 .. 1. Clipping a concave polygon may leave edges that
 * run back and forth along the border of the cell. They enclose no area, so the result is exact.
 * work: [64 points] scratch space. */
static double cell_coverage(const MildSoleDef *def, const double *corner, double *work) {
    int count = def->points;
    double *a = work, *b = work + 32 * (size_t)def->points;
    memcpy(a, def->outline, 2 * (size_t)count * sizeof *a);
    for (int axis = 0; axis < 2 && count; axis++) {
        count = clip_half(a, count, b, axis, corner[axis], 1.0);
        if (count) {
            count = clip_half(b, count, a, axis, corner[axis] + def->pitch, -1.0);
        }
    }
    double twice = 0.0;
    for (int i = 0; i < count; i++) {
        int j = (i + 1) % count;
        twice += (a[2 * i] - corner[0]) * (a[2 * j + 1] - corner[1]) -
                 (a[2 * j] - corner[0]) * (a[2 * i + 1] - corner[1]);
    }
    return 0.5 * fabs(twice) / (def->pitch * def->pitch);
}

/* The raster with a cell border at phase[k] * pitch from the middle of the outline's bounding box.
 * It is measured from the middle so that mirrored outlines get mirrored rasters. */
static Raster raster_at(const MildSoleDef *def, const Outline *outline, const double *phase) {
    Raster raster;
    int cells[2];
    for (int k = 0; k < 2; k++) {
        double middle = 0.5 * (outline->low[k] + outline->high[k]) + phase[k] * def->pitch;
        double below = ceil((middle - outline->low[k]) / def->pitch - 1e-9);
        raster.origin[k] = middle - below * def->pitch;
        cells[k] = (int)ceil((outline->high[k] - raster.origin[k]) / def->pitch - 1e-9);
    }
    raster.columns = cells[0];
    raster.rows = cells[1];
    return raster;
}

/* Number of cells whose centre is inside the outline. *off_center receives the distance [m] between
 * the centroid of these cells and that of the outline. */
static int raster_count(const MildSoleDef *def, const Outline *outline, const Raster *raster,
                        double *off_center) {
    int count = 0;
    double sum[2] = {0.0, 0.0};
    for (int i = 0; i < raster->columns; i++) {
        for (int j = 0; j < raster->rows; j++) {
            double x = raster->origin[0] + (i + 0.5) * def->pitch;
            double y = raster->origin[1] + (j + 0.5) * def->pitch;
            if (!outline_inside(def, x, y)) {
                continue;
            }
            count++;
            sum[0] += x;
            sum[1] += y;
        }
    }
    *off_center =
        count ? hypot(sum[0] / count - outline->center[0], sum[1] / count - outline->center[1])
              : INFINITY;
    return count;
}

/* The raster whose cell count is nearest to the target or, without a target, to the outline's area
 * divided by that of a cell. Ties go to the raster with the nearest centroid. Without a target,
 * only rasters with a cell border or a cell centre in the middle of the bounding box are tried. */
static Raster raster_choose(const MildSoleDef *def, const Outline *outline) {
    int best_miss = INT32_MAX;
    double best_off = INFINITY;
    Raster best = {{0.0, 0.0}, 0, 0};
    int phases = def->target_elements ? RASTER_PHASES : 2;
    int target = def->target_elements ? def->target_elements
                                      : (int)lround(outline->area / (def->pitch * def->pitch));
    for (int i = 0; i < phases; i++) {
        for (int j = 0; j < phases; j++) {
            double phase[2] = {(double)i / phases, (double)j / phases}, off;
            Raster raster = raster_at(def, outline, phase);
            int count = raster_count(def, outline, &raster, &off);
            int miss = abs(count - target);
            if (miss > best_miss || (miss == best_miss && off >= best_off - 1e-9)) {
                continue;
            }
            best_miss = miss;
            best_off = off;
            best = raster;
        }
    }
    return best;
}

/* Second moments [m^4] of an outline about its centroid, along x and y. */
static void outline_moments(const MildSoleDef *def, const Outline *outline, double moment[2]) {
    double sign = 0.0;
    moment[0] = moment[1] = 0.0;
    for (int i = 0; i < def->points; i++) {
        const double *p = &def->outline[2 * i], *q = &def->outline[2 * ((i + 1) % def->points)];
        const double a[2] = {p[0] - outline->center[0], p[1] - outline->center[1]};
        const double b[2] = {q[0] - outline->center[0], q[1] - outline->center[1]};
        const double cross = a[0] * b[1] - b[0] * a[1];
        for (int k = 0; k < 2; k++) {
            moment[k] += cross * (a[k] * a[k] + a[k] * b[k] + b[k] * b[k]) / 12.0;
        }
        sign += cross;
    }
    for (int k = 0; k < 2; k++) {
        moment[k] = sign < 0.0 ? -moment[k] : moment[k];
    }
}

/* Elements of the raster, and by how much [-] their second moments miss the outline's, at most. */
static int raster_miss(const MildSoleDef *def, const Outline *outline, const double moment[2],
                       double *miss) {
    const double cell = def->pitch * def->pitch;
    const Raster raster = raster_choose(def, outline);
    double sum[2] = {0.0, 0.0};
    int count = 0;
    for (int i = 0; i < raster.columns * raster.rows; i++) {
        const double at[2] = {raster.origin[0] + (i / raster.rows + 0.5) * def->pitch,
                              raster.origin[1] + (i % raster.rows + 0.5) * def->pitch};
        const int in = outline_inside(def, at[0], at[1]);
        count += in;
        for (int k = 0; k < 2; k++) {
            const double arm = at[k] - outline->center[k];
            sum[k] += in * cell * (arm * arm + cell / 12.0);
        }
    }
    *miss = fmax(fabs(sum[0] / moment[0] - 1.0), fabs(sum[1] / moment[1] - 1.0));
    return count;
}

/* The pitch [m] nearest to MATERIAL_PITCH whose elements have the outline's area, and its second
 * moments within PITCH_LEVER; else the one that misses these least. Without any, MATERIAL_PITCH. */
static double pitch_choose(const MildSoleDef *def) {
    const Outline outline = outline_measure(def);
    double moment[2], least = INFINITY, best = MATERIAL_PITCH;
    outline_moments(def, &outline, moment);
    for (int k = 0; k <= 2 * PITCH_FINER && least > PITCH_LEVER; k++) {
        const int power = k % 2 ? (k + 1) / 2 : -k / 2; /* 0, 1, -1, 2, ... */
        MildSoleDef tried = *def;
        double miss = INFINITY;
        tried.pitch = MATERIAL_PITCH * pow(PITCH_RATIO, power);
        const int count = power > PITCH_COARSER ? 0 : raster_miss(&tried, &outline, moment, &miss);
        if (count == 0) {
            continue;
        }
        tried.pitch = sqrt(outline.area / count);
        if (tried.pitch >= 1e-3 && tried.pitch <= 1.0 &&
            raster_miss(&tried, &outline, moment, &miss) == count && miss < least - 1e-9) {
            least = miss;
            best = tried.pitch;
        }
    }
    return best;
}

typedef struct {
    double coverage; /* [-] share of its area inside the outline */
    int cell;        /* column times rows plus row */
    int inside;      /* bool: its centre is inside the outline */
} Cell;

/* Cells whose centre is inside come first, then those with more coverage. Ties are broken by index,
 * so that the order does not depend on the sorting algorithm. */
static int cell_compare(const void *left, const void *right) {
    const Cell *a = left, *b = right;
    if (a->inside != b->inside) {
        return b->inside - a->inside;
    }
    if (a->coverage != b->coverage) {
        return a->coverage < b->coverage ? 1 : -1;
    }
    return a->cell - b->cell;
}

static int cell_compare_place(const void *left, const void *right) {
    return ((const Cell *)left)->cell - ((const Cell *)right)->cell;
}

/* Fills `cells` so that the first *chosen of them make the sole, in the order of their indices.
 * Returns false when fewer cells than the target touch the outline. */
static int cells_choose(const MildSoleDef *def, const Raster *raster, Cell *cells, double *work,
                        int *chosen) {
    int total = raster->columns * raster->rows;
    int inside = 0;
    for (int cell = 0; cell < total; cell++) {
        double corner[2] = {raster->origin[0] + cell / raster->rows * def->pitch,
                            raster->origin[1] + cell % raster->rows * def->pitch};
        Cell *c = &cells[cell];
        *c =
            (Cell){cell_coverage(def, corner, work), cell,
                   outline_inside(def, corner[0] + 0.5 * def->pitch, corner[1] + 0.5 * def->pitch)};
        inside += c->inside;
    }
    qsort(cells, (size_t)total, sizeof *cells, cell_compare);
    *chosen = def->target_elements ? def->target_elements : inside;
    if (*chosen < 1 || *chosen > total || !(cells[*chosen - 1].coverage > 1e-9)) {
        return 0;
    }
    qsort(cells, (size_t)*chosen, sizeof *cells, cell_compare_place);
    return 1;
}

static MildSole *sole_from_cells(const MildSoleDef *def, const Outline *outline,
                                 const Raster *raster, const Cell *cells, int count) {
    MildSole *sole = malloc(sizeof *sole + SOLE_PLANE_ARRAYS * (size_t)count * sizeof(double));
    if (!sole) {
        return NULL;
    }
    sole->elements = count;
    sole->shell = 0;
    sole->pitch = def->pitch;
    sole->width = fmin(outline->high[0] - outline->low[0], outline->high[1] - outline->low[1]);
    sole->z = def->sole_z;
    for (int i = 0; i < count; i++) {
        sole->values[i] = raster->origin[0] + (cells[i].cell / raster->rows + 0.5) * def->pitch;
        sole->values[count + i] =
            raster->origin[1] + (cells[i].cell % raster->rows + 0.5) * def->pitch;
    }
    return sole;
}

static MildSole *sole_raster(const MildSoleDef *def, MildError *error) {
    if (outline_check(def, error) != MILD_OK) {
        return NULL;
    }
    Outline outline = outline_measure(def);
    Raster raster = raster_choose(def, &outline);
    MildSole *sole = NULL;
    int chosen = 0;
    int reached = 1;
    /* Each of the four clips at most doubles the number of points. Two buffers of 16 times as many
     * points, two numbers each, make 64. */
    double *work = malloc(64 * (size_t)def->points * sizeof *work);
    Cell *cells = malloc(((size_t)raster.columns * (size_t)raster.rows + 1) * sizeof *cells);
    if (work && cells) {
        reached = cells_choose(def, &raster, cells, work, &chosen);
        if (reached) {
            sole = sole_from_cells(def, &outline, &raster, cells, chosen);
        }
        if (sole) {
            double *x = sole->values;
            sole_edges(def, &outline, chosen, x, x + chosen, x + SOLE_EDGE * chosen,
                       x + SOLE_SPREAD * chosen, (int *)work);
        }
    }
    free(cells);
    free(work);
    if (!reached && !def->target_elements) {
        mild_fail(error, MILD_ERROR_RANGE,
                  "sole: its outline has no centre of a cell of pitch %g; use a smaller sole.pitch",
                  def->pitch);
    } else if (!reached) {
        mild_fail(
            error, MILD_ERROR_RANGE,
            "sole.target_elements = %d: fewer cells of pitch %g touch the outline; use a smaller "
            "sole.pitch",
            def->target_elements, def->pitch);
    } else if (!sole) {
        mild_fail(error, MILD_ERROR_MEMORY, "sole: out of memory for %d elements", chosen);
    }
    return sole;
}

MildSole *mild_sole_create(const MildSoleDef *def, MildError *error) {
    if (numbers_check(def, error) != MILD_OK) {
        return NULL;
    }
    MildSoleDef own = *def;
    if (own.pitch == 0.0) {
        own.pitch = MATERIAL_PITCH;
        if (outline_check(&own, error) != MILD_OK) {
            return NULL;
        }
        own.pitch = own.target_elements ? MATERIAL_PITCH : pitch_choose(&own);
    }
    return sole_raster(&own, error);
}

MildSole *mild_sole_concentric(const MildSole *sole, MildError *error) {
    if (sole->shell) {
        mild_fail(error, MILD_ERROR_ARGUMENT,
                  "sole: a shell has no middle; a concentric model needs mild_sole_create");
        return NULL;
    }
    MildSole *one = malloc(sizeof *one + SOLE_PLANE_ARRAYS * sizeof(double));
    if (!one) {
        mild_fail(error, MILD_ERROR_MEMORY, "sole: out of memory for one element");
        return NULL;
    }
    *one = (MildSole){.elements = 1,
                      .pitch = sole->pitch * sqrt((double)sole->elements),
                      .width = sole->width,
                      .z = sole->z};
    /* A disc of that area. */
    const double radius = one->pitch / sqrt(LAW_PI);
    one->values[SOLE_EDGE] = radius / 3.0;
    one->values[SOLE_SPREAD] = radius / sqrt(18.0);
    one->values[0] = one->values[1] = 0.0;
    for (int i = 0; i < sole->elements; i++) {
        one->values[0] += sole->values[i] / sole->elements;
        one->values[1] += sole->values[sole->elements + i] / sole->elements;
    }
    return one;
}

void mild_sole_destroy(MildSole *sole) {
    free(sole);
}

int mild_sole_elements(const MildSole *sole) {
    return sole->elements;
}

double mild_sole_pitch(const MildSole *sole) {
    return sole->pitch;
}

double mild_sole_width(const MildSole *sole) {
    return sole->width;
}

const double *mild_sole_x(const MildSole *sole) {
    return sole->values;
}

const double *mild_sole_y(const MildSole *sole) {
    return sole->values + sole->elements;
}

double mild_sole_z(const MildSole *sole) {
    return sole->z;
}

SoleHeap sole_heap(const MildSole *sole, int element) {
    const int n = sole->elements;
    const double radius = MATERIAL_PITCH / sqrt(LAW_PI);
    if (sole->shell) {
        return (SoleHeap){LAW_HEAP_LEAST, fmax(0.5 * sole->width / radius, 1.0)};
    }
    const double edge = sole->values[SOLE_EDGE * n + element] / radius;
    const double spread = sole->values[SOLE_SPREAD * n + element] / radius;
    /* The flat share (1 - t)^2 says that distances from `begin` on have the density 2 (1 - t): the
     * mean is a third of the width, the variance an 18th of its square. A heap begins to close
     * below the surface, if only by a hair: what begins at 0 is a cone (law_is_heap). */
    const double width = fmax(fmin(sqrt(18.0) * spread, 3.0 * edge), 1e-6);
    return (SoleHeap){fmax(edge - width / 3.0, LAW_HEAP_LEAST), width};
}

const double *mild_sole_edge(const MildSole *sole) {
    return sole->shell ? NULL : sole->values + (size_t)SOLE_EDGE * (size_t)sole->elements;
}
