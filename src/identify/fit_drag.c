#include "identify/fit_law.h"

#include <math.h>

#include "ground/law/models.h"

#define STRIDE 2e-4 /* [m] slip in a step of the path */
#define STRIDES_MAX 100

int fit_drag_is_modelled(MildModel model) {
    return model_row((int)model)->slips;
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
    const double longer = strides * (1 + (double)share->growth * fmax(row->depth, 0));
    for (int i = 0; i < strides; i++) {
        const double left = grows ? exp(-fresh / longer * (double)share->regain_rate) : 1;
        path->share /= 1 + path->share * way / longer * (double)share->slip_rate;
        path->share = 1 - (1 - path->share) * left;
    }
    path->slip = row->slip;
    path->deepest += fresh;
}

/* [-] Friction of ground that carries the share q of its virgin load. */
static double friction(const MildMaterial *material, const Share *share, double q) {
    const double grips = (double)SHARE_YIELD * (double)share->grip * (1 - q) / (2 - q);
    return share->grip > 0 ? fmin(material->mu, fmax(grips, (double)share_least(share)))
                           : material->mu;
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
