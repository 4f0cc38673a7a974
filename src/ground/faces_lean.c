#include "ground/faces_lean.h"

#include "ground/rim.h"

/* A slot of a surface, as the rim sees it. */
typedef struct {
    double x, y, u; /* [m] its place, world axes, and rim_depth */
    double down;    /* [-] downward part of its outward normal */
} RimPoint;

static RimPoint point_of(const FootScratch *foot, int i) {
    const Slots *s = slot_block(foot, i);
    const int e = foot->element[i], l = i % SLOT_LANES;
    return (RimPoint){foot->point_x[e] - foot->origin[0], foot->point_y[e] - foot->origin[1],
                      rim_depth(s->depth[l], s->depth_max[l]), foot->share[e] / foot->area[e]};
}

void faces_lean(const FootScratch *foot) {
    double sums[RIM_SUMS] = {0.0};
    for (int i = 0; i < foot->active; i++) {
        const RimPoint at = point_of(foot, i);
        const double area = foot->area[foot->element[i]] * foot->pitch * foot->pitch;
        rim_add(sums, at.x, at.y, at.u, at.down, area);
    }
    const Rim rim = rim_of(sums);
    for (int i = 0; i < foot->active; i++) {
        const RimPoint at = point_of(foot, i);
        Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        Element element = slot_element(s, l);
        element.law.cone_begin = s->cone_begin[l];
        const double level = rim_level(&rim, &element.law, foot->heap->width, s->recovery[l], at.x,
                                       at.y, at.u, at.down);
        s->lean[l] = s->projects[l] > 0.0 && at.u > 0.0 ? level : 1.0;
    }
}
