#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include "ground/step/carry.h"

#include <string.h>

#include "ground/step/shell_lean.h"

/* This loop is not in vectors, for which a power is long: few feet stand on ground without memory
 * beside other ground. */
void slots_elastic(const FootScratch *foot) {
    for (Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
        memset(s->fx, 0, sizeof s->fx);
    }
    for (int i = 0; foot->curves & LAW_ELASTIC && i < foot->active; i++) {
        Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        const Element element = slot_element(s, l);
        s->fx[l] = law_elastic_force(&element.law, LAW_ELASTIC, element.middle);
    }
}

/* Cosine between the sole and the ground under each slot, into `lean`. Level ground has one for
 * all, without a root for each. */
static void slots_lean(const FootScratch *foot) {
    const double *normal = foot->arm[3];
    const Real side = normal[2] < 0 ? REAL(-1) : REAL(1); /* the face that looks down */
    const Real up[3] = {side * (Real)normal[0], side * (Real)normal[1], side * (Real)normal[2]};
    const Real level = real_min(real_max(up[2], SHARE_LEAN), 1);
    for (Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
        for (int i = 0; i < SLOT_LANES; i++) {
            s->lean[i] = level;
        }
        for (int i = 0; foot->uneven && i < SLOT_LANES; i++) {
            const Real gx = s->slope_x[i], gy = s->slope_y[i];
            const Real along = up[2] - gx * up[0] - gy * up[1];
            s->lean[i] =
                real_min(real_max(along / REAL_SQRT(1 + gx * gx + gy * gy), SHARE_LEAN), 1);
        }
    }
}

MILD_HD void slot_carry(Slots *s, int i, Real dt, Real rate, const Motion *now) {
    const SlotVelocity v = slot_velocity(s, i, now, SLOT_UNEVEN | SLOT_SHELL);
    const ElementMemory memory = slot_memory(s, i);
    Element element = slot_element(s, i);
    element.law.cone_begin = s->cone_begin[i];
    Share share = slot_share(s, i);
    element_share(&element, &memory, &share, s->fx[i], dt, rate, share.lean, s->ahead[i],
                  v.x * v.x + v.y * v.y);
    s->mu[i] = element.mu;
    s->drift_bound[i] = element.drift_bound;
    s->lean[i] = share.lean;
    s->share[i] = share.q;
    s->zero_depth[i] = element.zero_depth;
    s->hold_x[i] = element.hold_x;
    s->hold_y[i] = element.hold_y;
    s->hold_stiffness[i] = element.hold_stiffness;
}

void foot_carry(const FootScratch *foot, const Motion *now, double dt) {
    slots_elastic(foot);
    if (foot->shell) {
        shell_lean(foot, now);
    } else {
        slots_lean(foot);
    }
    const double rate = 1.0 / dt;
    const Motion motion = *now;
    for (Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            slot_carry(s, i, dt, rate, &motion);
        }
    }
}
