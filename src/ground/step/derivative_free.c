/* By how much the impulses of a foot depend on the free motion at fixed twists. Its loop is
 * compiled as those of pass.c. */
#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include "ground/law/begin.h"
#include "ground/law/impulse.h"
#include "ground/step/step.h"

#define FREE_RAISED 1e-12 /* [m/s] least rise of the entry speed, above its rounding */

enum { FREE_CURVES = LAW_CONE | LAW_HEAP }; /* those of ground with drag */

/* [kg] Derivative of an element's normal impulse with respect to the downward speed of the free
 * motion, at the new downward speed `speed`. rate: 1/dt. before: its downward speed before the
 * step. With h the entry speed, D the coefficient of the growth r,
 *
 *     dh/dfree = (a - m0)/(dt h)                       where the free motion has raised h
 *     dD/dh    = entry_drag + s' (h - w)^2 + 2 s (h - w),   s = extra (stop - 1/2)/h
 *     dI/dfree = (r dD/dh + dlag/dh) dh/dfree + min(m_a, 0)
 *
 * (element_drag, growth_impulse, lag_impulse, element_explicit). */
MILD_HD double element_free(const Element *e, double dt, double rate, double speed, double before) {
    const double h = e->entry_speed, a = e->yield_depth;
    const double inverse = 1 / (h + ELEMENT_TINY);
    const double way = real_max((Real)(a - e->middle), 0) * rate * inverse;
    const double raised = h - real_max((Real)before, 0) > FREE_RAISED ? way : 0.0;

    const double end = e->virgin_depth + real_max((Real)(e->depth + dt / 2 * speed - a), 0);
    const double moved = law_moved(&e->law, FREE_CURVES, e->virgin_depth);
    const double grown = law_moved(&e->law, FREE_CURVES, (Real)end) - moved;
    const double counts = real_max(grown, real_min(2 * grown, e->stop_growth));
    const double lost = real_max((Real)(h - real_max((Real)speed, 0)), 0);
    /* s falls with 1/h, and by the part of `stop` that does, unless that is at its most */
    const double extra = real_max(2 * e->entry_drag, 0), s = e->stop_drag;
    const double part = extra * (BEGIN_STOP - 0.5) * inverse - s;
    const double falls = s * h < extra * (BEGIN_STOP_MOST - 0.5 - 1e-9) ? part : 0.0;
    const double drag_slope = e->entry_drag + ((falls - s) * inverse * lost + 2 * s) * lost;
    const double lag = lag_impulse(e, (Real)dt, (Real)speed).slope;

    const double mass = real_min(e->law.mass_rate, 0) * moved; /* b = a where there is mass */
    return (counts * drag_slope + lag) * raised + (e->explicit_impulse != 0 ? mass : 0.0);
}

/* Twists of a foot, its elements' speeds of which foot_free needs. */
typedef struct {
    Motion now;   /* before the step */
    Motion after; /* of the solution */
} Motions;

/* element_free of a slot, 0 where nothing presses. */
MILD_HD double slot_free(const Slots *s, int i, double dt, double rate, const Motions *m) {
    const int kind = SLOT_UNEVEN | SLOT_SHELL;
    const Element e = slot_loaded(s, i, FREE_CURVES);
    const double slope = element_free(&e, dt, rate, slot_velocity(s, i, &m->after, kind).descent,
                                      slot_velocity(s, i, &m->now, kind).descent);
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

/* Columns of a block that may not be 0: on level ground those of moving up and of the tilts. */
typedef struct {
    int first, end;
} Columns;

/* Adds k (B^T c) (B^T g)^T of a block of slots, whose c are (across, along, 1), by columns. */
static void block_add(const FootScratch *foot, const Slots *s, Columns columns, const Lanes k,
                      const Lanes across, const Lanes along, LaneVector sums[36]) {
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
    for (int l = columns.first; l < columns.end; l++) {
        const LaneVector column = lanes_load(k) * from[l];
#pragma GCC unroll 6
        for (int r = 0; r < 6; r++) {
            sums[6 * l + r] += column * to[r];
        }
    }
}

void foot_free(const FootScratch *foot, const MildContactInput *input, int f, const double *twist,
               double block[36]) {
    double before[6], turned[6];
    twist_of_world(foot, input->velocity[f], before);
    twist_of_world(foot, twist, turned);
    const Motions m = {foot_motion(foot, before), foot_motion(foot, turned)};
    const double dt = input->dt, rate = 1 / dt;
    const Columns columns = {foot->uneven ? 0 : 2, foot->uneven ? 6 : 5};
    LaneVector sums[36] = {{0.0}};
    double turned_round[36];
    for (const Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
        _Alignas(LaneVector) Lanes k, across, along;
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            const Real inverse = 1 / (s->hzz[i] + REAL_LEAST);
            k[i] = -(Real)slot_free(s, i, dt, rate, &m);
            across[i] = s->hxz[i] * inverse; /* h has the column dI_z/dw c, above 0 where I_z is */
            along[i] = s->hyz[i] * inverse;
        }
        block_add(foot, s, columns, k, across, along, sums);
    }
    lanes_sum((const Lanes *)sums + 6 * columns.first, 6 * (columns.end - columns.first),
              turned_round);
    for (int i = 6 * columns.first; i < 6 * columns.end; i++) {
        block[i % 6 * 6 + i / 6] = turned_round[i - 6 * columns.first];
    }
}
