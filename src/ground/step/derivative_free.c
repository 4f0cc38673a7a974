/* By how much the impulses of a foot depend on the free motion at fixed twists. Its loop is
 * compiled as those of pass.c. */
#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include "ground/step/derivative_free.h"

#include "ground/law/begin.h"
#include "ground/law/impulse.h"
#include "ground/step/step.h"

/* [kg] Derivative of an element's normal impulse with respect to the downward speed of the free
 * motion, at the new downward speed `speed`. rate: 1/dt. before, free: its downward speed before
 * the step, and of the free motion. With h the entry speed, D the coefficient of the growth r,
 *
 *     dh/dfree = (a - m0)/(dt h)                       where the free motion speeds it up
 *     dD/dh    = entry_drag + s' (h - w)^2 + 2 s (h - w),   s = extra (stop - 1/2)/h
 *     dI/dfree = (r dD/dh + dlag/dh) dh/dfree + min(m_a, 0)
 *
 * (element_drag, growth_impulse, lag_impulse, element_explicit). */
MILD_HD double element_free(const Element *e, int curves, double dt, double rate, double speed,
                            double before, double free, int creates) {
    const double h = e->entry_speed, a = e->yield_depth;
    const double extra = real_max(2 * e->entry_drag, 0);
    const double ahead = e->depth + dt / 2 * real_max((Real)before, 0) - a - ELEMENT_ELASTIC;
    const int drags = (extra > 0.0) & (ahead > 0.0) & (free > before) & (h > 0.0);
    const double inverse = 1 / (h + ELEMENT_TINY);
    const double raised = drags ? real_max((Real)(a - e->middle), 0) * rate * inverse : 0.0;

    const PowerWay none = {0, 0};
    const double way = real_max((Real)(e->depth + dt / 2 * speed - a), 0);
    const LawWay virgin = law_way(&e->law, curves, e->virgin_depth, (Real)way, &none);
    const double grown = real_max(virgin.recruited, real_min(2 * virgin.recruited, e->stop_growth));
    const double lost = real_max((Real)(h - real_max((Real)speed, 0)), 0);
    /* s falls with 1/h, and by the part of `stop` that does, unless that is at its most */
    const double s = e->stop_drag;
    const int falls = s * h < extra * (BEGIN_STOP_MOST - 0.5 - 1e-9);
    const double part = falls ? extra * (BEGIN_STOP - 0.5) * inverse - s : 0.0;
    const double stop_drag_slope = (part - s) * inverse;
    const double drag_slope = e->entry_drag + stop_drag_slope * lost * lost + 2 * s * lost;
    const double lag = lag_impulse(e, (Real)dt, (Real)speed).slope;

    const double mass = real_min(e->law.mass_rate * law_moved(&e->law, curves, (Real)a), 0);
    return (creates ? mass : 0.0) + (grown * drag_slope + lag) * raised;
}

/* Twists of a foot, its elements' speeds of which foot_free needs. */
typedef struct {
    Motion now;   /* before the step */
    Motion free;  /* of the free motion */
    Motion after; /* of the solution */
} Motions;

/* element_free of a slot. */
MILD_HD double slot_free(const Slots *s, int i, double dt, double rate, const Motions *m,
                         int curves, int creates) {
    const int kind = SLOT_UNEVEN | SLOT_SHELL;
    const Element e = slot_loaded(s, i, curves);
    const int explicit = creates & (s->depth[i] > 0) & !(s->middle[i] < s->depth_max[i]);
    const double slope =
        element_free(&e, curves, dt, rate, slot_velocity(s, i, &m->after, kind).descent,
                     slot_velocity(s, i, &m->now, kind).descent,
                     slot_velocity(s, i, &m->free, kind).descent, explicit);
    return s->iz[i] > 0 ? slope : 0.0;
}

/* b = (c, p x c): what a force c at p does to a foot. */
static inline void lanes_wrench(const LaneVector p[3], const LaneVector c[3], LaneVector b[6]) {
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        b[k] = c[k];
        b[3 + k] = p[i] * c[j] - p[j] * c[i];
    }
}

/* Adds k (B^T c) (B^T g)^T of a block of slots, whose c are (across, along, 1). */
static void block_add(const FootScratch *foot, const Slots *s, const Lanes k, const Lanes across,
                      const Lanes along, LaneVector sums[36]) {
    const LaneVector x = lanes_load(s->x), y = lanes_load(s->y), z = lanes_load(s->z);
    const LaneVector one = x * 0 + 1;
    const LaneVector g[3] = {-lanes_load(s->slope_x), -lanes_load(s->slope_y), one};
    const LaneVector c[3] = {lanes_load(across), lanes_load(along), one};
    LaneVector p[3], from[6], to[6];
    for (int i = 0; i < 3; i++) {
        p[i] = (Real)foot->lever[0][i] + (Real)foot->lever[1][i] * x + (Real)foot->lever[2][i] * y +
               (Real)foot->lever[3][i] * z;
    }
    lanes_wrench(p, g, from);
    lanes_wrench(p, c, to);
    for (int r = 0; r < 6; r++) {
        const LaneVector row = lanes_load(k) * to[r];
        for (int l = 0; l < 6; l++) {
            sums[6 * r + l] += row * from[l];
        }
    }
}

MILD_HD void foot_free_of(const FootScratch *foot, double dt, const Motions *moves, int curves,
                          int creates, double block[36]) {
    const Motions m = *moves;
    const double rate = 1 / dt;
    LaneVector sums[36] = {{0.0}};
    for (const Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
        Lanes k, across, along;
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            const Real inverse = 1 / (s->hzz[i] + REAL_LEAST);
            k[i] = (Real)slot_free(s, i, dt, rate, &m, curves, creates);
            across[i] = s->hxz[i] * inverse; /* h has the column dI_z/dw c, above 0 where I_z is */
            along[i] = s->hyz[i] * inverse;
        }
        block_add(foot, s, k, across, along, sums);
    }
    lanes_sum((const Lanes *)sums, 36, block);
}

void foot_free(const FootScratch *foot, const MildContactInput *input, int f, const double *twist,
               int creates, double block[36]) {
    double before[6], fell[6], turned[6];
    twist_of_world(foot, input->velocity[f], before);
    twist_of_world(foot, input->free_velocity + 6 * f, fell);
    twist_of_world(foot, twist, turned);
    const Motions moves = {foot_motion(foot, before), foot_motion(foot, fell),
                           foot_motion(foot, turned)};
    foot_free_of(foot, input->dt, &moves, LAW_CONE | LAW_HEAP, creates, block);
}
