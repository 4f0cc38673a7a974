#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include "ground/step/drag.h"

void slots_drag_any(const FootScratch *foot, double dt, const Motion *now, const Motion *free) {
    const int curves =
        foot->curves | LAW_CONE | LAW_HEAP; /* no branches for these; a power is long */
    for (int i = 0; i < foot->active; i++) {
        slot_drag(slot_block(foot, i), i % SLOT_LANES, dt, now, free, curves,
                  SLOT_UNEVEN | SLOT_SHELL);
    }
}

int slots_explicit(const FootScratch *foot, int materials, double dt, const Motion *free) {
    int any = 0;
    for (int m = 0; m < materials; m++) {
        any |=
            foot->derived[m].slot.law.mass_rate < 0.0 || foot->derived[m].slot.law.drag_rate < 0.0;
    }
    for (int i = 0; any && i < foot->active; i++) {
        Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        if (!(s->depth[l] > 0.0) || s->middle[l] < s->depth_max[l]) {
            continue; /* above the ground or on the unloading line */
        }
        const Element element = slot_loaded(s, l, LAW_ANY);
        s->explicit_impulse[l] = element_explicit(
            &element, LAW_ANY, dt, slot_velocity(s, l, free, SLOT_UNEVEN | foot->shell).descent);
    }
    return any;
}
