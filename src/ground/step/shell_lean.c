#include "ground/step/shell_lean.h"

#include "ground/law/rim.h"

/* A slot of a shell, as the rim sees it. */
typedef struct {
    double x, y, u; /* [m] its place, world axes, and rim_depth */
    double down;    /* [-] downward part of its outward normal */
} RimPoint;

static RimPoint point_of(const FootScratch *foot, int i) {
    const Slots *s = slot_block(foot, i);
    const int e = foot->element[i], l = i % SLOT_LANES;
    return (RimPoint){foot->point_x[e] - foot->origin[0], foot->point_y[e] - foot->origin[1],
                      rim_depth(s->depth[l], s->depth_max[l]), foot->area_share[e] / foot->area[e]};
}

/* [N] share_ahead of slot i, whose law is `element`. down: downward part of its outward normal. */
static double ahead_of(const FootScratch *foot, int i, const Element *element, const Motion *now,
                       Real down) {
    const Slots *s = slot_block(foot, i);
    const int e = foot->element[i], l = i % SLOT_LANES;
    const SlotVelocity v = slot_velocity(s, l, now, SLOT_UNEVEN | SLOT_SHELL);
    const Share share = slot_share(s, l);
    Real n[3] = {0, 0, -down};
    for (int k = 0; k < 3; k++) {
        n[0] += foot->face[k][e] * foot->arm[k + 1][0];
        n[1] += foot->face[k][e] * foot->arm[k + 1][1];
    }
    return share_ahead(element, &share, s->lean[l], n, v.x, v.y, v.descent);
}

/* [-] rim_share of a slot at the depth u. */
static double share_of_slot(const Slots *s, int l, double bears, double u) {
    const Element element = slot_element(s, l);
    Law law = element.law;
    law.cone_begin = s->cone_begin[l];
    return rim_share(&element.law, s->recovery[l], bears, rim_force(&law, u));
}

void shell_lean(const FootScratch *foot, const Motion *now) {
    Real sums[RIM_SUMS] = {0};
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
        const Element element = slot_element(s, l);
        const double bears =
            rim_bears(&rim, &element.law, foot->heap->width, at.x, at.y, at.u, at.down);
        const double level = share_of_slot(s, l, bears, at.u);
        s->lean[l] = s->projects[l] > 0.0 && at.u > 0.0 ? level : 1.0;
        s->ahead[l] = ahead_of(foot, i, &element, now, at.down);
    }
}
