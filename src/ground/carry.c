#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include "ground/carry.h"

#include <string.h>

/* Force of ground without memory [N], into the working array fx. It is 0 but for hunt_crossley
 * beside ground with LAW_HEAP, so this loop is not in vectors, for which a power is long. */
static void slots_elastic(const FootScratch *foot) {
    const Slots *s = &foot->slot;
    memset(s->fx, 0, (size_t)foot_end(foot) * sizeof *s->fx);
    for (int i = 0; foot->curves & LAW_ELASTIC && i < foot->active; i++) {
        const Element element = slot_element(s, i);
        s->fx[i] = law_elastic_force(&element.law, LAW_ELASTIC, element.middle);
    }
}

/* Cosine between the sole and the ground under each slot, into `lean`. */
static void slots_lean(const FootScratch *foot) {
    const Slots local = foot->slot, *s = &local;
    const double side = foot->arm[3][2] < 0.0 ? -1.0 : 1.0; /* the face that looks down */
    const double up[3] = {side * foot->arm[3][0], side * foot->arm[3][1], side * foot->arm[3][2]};
    const double level = real_min(real_max(up[2], SHARE_LEAN), 1.0);
    const int end = foot_end(foot);
    for (int i = 0; i < end; i++) {
        s->lean[i] = level;
    }
    for (int i = 0; foot->uneven && i < end; i++) {
        const double gx = s->slope_x[i], gy = s->slope_y[i];
        const double along = up[2] - gx * up[0] - gy * up[1];
        s->lean[i] = real_min(real_max(along / sqrt(1.0 + gx * gx + gy * gy), SHARE_LEAN), 1.0);
    }
}

MILD_HD void slot_carry(const Slots *s, int i, double dt, double rate) {
    const ElementMemory memory = slot_memory(s, i);
    Element element = slot_element(s, i);
    Share share = slot_share(s, i);
    element_share(&element, &memory, &share, s->fx[i], dt, rate, share.lean);
    s->mu[i] = element.mu;
    s->lean[i] = share.lean;
    s->carry[i] = share.carry;
    s->zero_depth[i] = element.zero_depth;
    s->hold_x[i] = element.hold_x;
    s->hold_y[i] = element.hold_y;
    s->hold_stiffness[i] = element.hold_stiffness;
}

void foot_carry(const FootScratch *foot, double dt) {
    slots_elastic(foot);
    slots_lean(foot);
    const Slots local = foot->slot, *s = &local;
    const double rate = 1.0 / dt;
    const int end = foot_end(foot);
    if (end < VECTOR_LANES) {
        return; /* never. The compiler then adds no loop for a remainder */
    }
#pragma omp simd
    for (int i = 0; i < end; i++) {
        slot_carry(s, i, dt, rate);
    }
}
