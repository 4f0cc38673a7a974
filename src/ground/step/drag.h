/* Drag of slots: what is not in the vector loop of prepare.c. */
#ifndef MILD_GROUND_DRAG_H
#define MILD_GROUND_DRAG_H

#include "ground/law/begin.h"
#include "ground/step/scratch.h"

/* Calls element_drag. curves, kind: constants in a vector loop. */
MILD_HD void slot_drag(Slots *s, int i, Real dt, const Motion *now, const Motion *free, int curves,
                       int kind) {
    const Real slower = slot_velocity(s, i, now, kind).descent;
    const Real faster = slot_velocity(s, i, free, kind).descent;
    Element element = slot_loaded(s, i, curves);
    element_drag(&element, curves, dt, real_max(faster - slower, 0));
    s->entry_speed[i] = element.entry_speed;
    s->stop_drag[i] = element.stop_drag;
    s->stop_growth[i] = element.stop_growth;
}

/* The same for all slots of a foot on any ground. */
void slots_drag_any(const FootScratch *foot, double dt, const Motion *now, const Motion *free);
/* Sets the explicit impulse of materials that create energy (passive = false). Returns true when
 * the terrain has such a material. */
int slots_explicit(const FootScratch *foot, int materials, double dt, const Motion *free);

#endif
