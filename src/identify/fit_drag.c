#include "identify/fit_drag.h"

#include <math.h>

#include "ground/models.h"

/* [m] Where rows tell friction: grains need some millimetres of slip to build it up, and later heap
 * up before the plate. */
#define BUILT 0.005
#define HEAPED 0.012

#define LEAST 0.01  /* [-] of the largest force: a row counts as if it were that at least */
#define STRIDE 2e-4 /* [m] slip in a step of the path */
#define STRIDES_MAX 100

int fit_drag_told(MildModel model) {
    return model_row((int)model)->slips;
}

MildMaterial fit_drag_base(const MildMaterial *known, const MildMaterial *press) {
    MildMaterial base = press ? *press : *known;
    base.mu = known->mu;
    base.phi = known->phi;
    base.rho = known->rho;
    base.recovery = known->recovery;
    base.slip_length = known->slip_length;
    base.regain_length = known->regain_length;
    base.grip = known->grip;
    return base;
}

/* ---- rows ---- */

/* [N] Mean force around a row of those that slide, from `first` on. */
static double near_force(const FitPoint *slide, int first, int count, int row) {
    const int half = (count - first) / 40 > 1 ? (count - first) / 40 : 1;
    const int low = row - half > first ? row - half : first;
    const int high = row + half < count - 1 ? row + half : count - 1;
    double sum = 0;
    for (int i = low; i <= high; i++) {
        sum += slide[i].force;
    }
    return sum / (high - low + 1);
}

int fit_drag_rows(const FitPlate *plate, const MildMaterial *curve, const FitPoint *slide,
                  int count, FitPoint *rows) {
    int kept = 0, first = 0;
    double most = 0;
    while (first < count && slide[first].slip <= 0) {
        first++;
    }
    for (int i = 0; i < count; i++) {
        most = fmax(most, slide[i].force);
    }
    for (int i = 0; i < count; i++) {
        const FitPoint still = {.depth = slide[i].depth, .area = slide[i].area};
        FitPoint *row = &rows[kept++];
        *row = slide[i];
        row->near = fmax(i < first ? most : near_force(slide, first, count, i), LEAST * most);
        row->weight = sqrt(most / row->near);
        fit_forces(FIT_PRESS, plate, curve, &still, 1, &row->virgin);
        row->force *= row->weight;
        row->speed = row->acceleration = 0;
        row->holds = 0;
    }
    for (int i = first; i < count; i++) {
        if (slide[i].slip >= BUILT && slide[i].slip <= HEAPED && isfinite(slide[i].along)) {
            rows[kept] = rows[i];
            rows[kept].force = slide[i].along;
            rows[kept].weight = 1;
            rows[kept++].holds = 1;
        }
    }
    return kept;
}

int fit_drag_is_next(const FitPoint *row) {
    const FitPoint *last = row - 1;
    return row->plate == last->plate &&
           (row->holds == last->holds ? row->slip >= last->slip : row->holds > last->holds);
}

/* ---- the law ---- */

typedef struct {
    double slip, deepest, share;
} Path;

/* Moves on to the slip and depth of a row. */
static void path_go(Path *path, const FitPoint *row, const Share *share, int grows) {
    const double way = row->slip - path->slip;
    const double fresh = fmax(row->depth - path->deepest, 0);
    const int strides = (int)fmin(1 + way / STRIDE, STRIDES_MAX);
    for (int i = 0; i < strides; i++) {
        const double left = grows ? exp(-fresh / strides * (double)share->regain_rate) : 1;
        path->share /= 1 + path->share * way / strides * (double)share->slip_rate;
        path->share = 1 - (1 - path->share) * left;
    }
    path->slip = row->slip;
    path->deepest += fresh;
}

/* [-] Friction of ground that carries the share q of its virgin load. */
static double friction(const MildMaterial *material, const Share *share, double q) {
    const double grips = (double)SHARE_YIELD * (double)share->grip * (1 - q) / (2 - q);
    return share->grip > 0 ? fmin(material->mu, fmax(grips, (double)SHARE_GRIP)) : material->mu;
}

/* Shares of the rows up, in `share`; the shares of the rows along are between theirs. */
static int shares_find(const Share *law, const MildMaterial *material, const FitPoint *points,
                       int count, double *share) {
    Path path = {.deepest = points[0].depth, .share = 1};
    int ups = 0;
    for (; ups < count && !points[ups].holds; ups++) {
        const int grows = material->recovery * points[ups].depth <= (double)ELEMENT_ELASTIC;
        if (points[ups].slip <= 0) { /* still pressed */
            path.deepest = fmax(path.deepest, points[ups].depth);
        }
        path_go(&path, &points[ups], law, grows);
        share[ups] = path.share;
    }
    for (int i = ups, k = 0; i < count; i++) {
        while (k + 1 < ups && points[k].slip < points[i].slip) {
            k++;
        }
        const double way = k > 0 ? points[k].slip - points[k - 1].slip : 0;
        const double part = way > 0 ? (points[i].slip - points[k - 1].slip) / way : 1;
        share[i] = k > 0 ? share[k - 1] + fmin(part, 1) * (share[k] - share[k - 1]) : share[k];
    }
    return ups;
}

void fit_drag_forces(const FitPlate *plate, const MildMaterial *material, const FitPoint *points,
                     int count, double *force) {
    const double width = plate->sole ? mild_sole_width(plate->sole) : 0;
    const Share law = share_of(material, plate->pitch, width);
    const int ups = shares_find(&law, material, points, count, force);
    double along = 0, square = 0;
    for (int i = ups; i < count; i++) {
        const double side = (double)law.side * plate->elements * points[i].depth * points[i].depth;
        force[i] = friction(material, &law, force[i]) * points[i].near + side;
    }
    for (int i = 0; i < ups; i++) {
        force[i] *= points[i].weight * points[i].virgin;
        along += force[i] * points[i].force;
        square += force[i] * force[i];
    }
    for (int i = 0; i < ups; i++) {
        force[i] *= square > 0 ? along / square : 0;
    }
}
