#include "identify/fit_law.h"

#include <math.h>

/* [m] Where rows determine friction: grains need some millimetres of slip to build it up, and later
 * heap up before the plate. */
#define BUILT 0.005
#define HEAPED 0.012

#define LEAST 0.01 /* [-] of the largest force: a row counts as if it were that at least */

MildMaterial fit_slide_base(const MildMaterial *known, const MildMaterial *press) {
    MildMaterial base = press ? *press : *known;
    base.mu = known->mu;
    base.phi = known->phi;
    base.rho = known->rho;
    base.recovery = known->recovery;
    base.slip_length = known->slip_length;
    base.regain_length = known->regain_length;
    base.grip = known->grip;
    base.slip_growth = known->slip_growth;
    return base;
}

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

int fit_slide_rows(const FitPlate *plate, const MildMaterial *curve, const FitPoint *slide,
                   int count, FitPoint *rows) {
    int kept = 0, first = 0;
    double most = 0;
    while (first < count && slide[first].slip <= 0) {
        first++;
    }
    for (int i = 0; i < count; i++) {
        most = fmax(most, slide[i].force);
    }
    for (int i = 0; most > 0 && i < count; i++) {
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
    for (int i = first; most > 0 && i < count; i++) {
        if (slide[i].slip >= BUILT && slide[i].slip <= HEAPED && isfinite(slide[i].along)) {
            rows[kept] = rows[i];
            rows[kept].force = slide[i].along;
            rows[kept].weight = 1;
            rows[kept++].holds = 1;
        }
    }
    return kept;
}
