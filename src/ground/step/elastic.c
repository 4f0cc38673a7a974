/* In a file of its own, because a law calls it: a program that links one takes no scratch. */
#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include <string.h>

#include "ground/step/scratch.h"

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
