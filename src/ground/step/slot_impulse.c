#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include "ground/step/slot_impulse.h"

Impulse slot_impulse(const Slots *s, int i, int curves, double dt, double w) {
    const Element element = slot_loaded(s, i, curves);
    return element_impulse(&element, curves, 1, dt, w);
}
