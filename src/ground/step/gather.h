/* Fills the slots of a foot with the positions and the memory of its listed elements. */
#ifndef MILD_GROUND_GATHER_H
#define MILD_GROUND_GATHER_H

#include "ground/step/scratch.h"

/* Copies the listed elements into consecutive slots. */
void slots_gather(const FootScratch *foot, const Memory *memory);

/* Sets slope and depth of the slots on uneven ground. before: bool, it was uneven in the last step
 * too. height: of the terrain [m].
 *
 * A step replaces the ground under an element by its tangent plane. Where the ground rises above
 * this plane, the element would be deeper after the step without having been pressed down, and
 * would gain energy. So an element that stays in the ground starts at its depth below the last
 * step's plane when that is smaller. */
void slots_uneven(const FootScratch *foot, int32_t before, const Memory *memory, double height,
                  const Motion *now);
/* Clears the slopes when a foot has left uneven ground. On level ground nothing writes them. */
void slots_level(const FootScratch *foot);

/* Multiplies what a slot's law makes of forces and masses. */
void slot_scale(Slots *s, int i, double share);

/* Sets the greatest depth of unloaded elements to that of the imprint under them. Below h0, within
 * an imprint, it is at least the depth whose unloading line reaches zero at the element, so that
 * moving sideways in an imprint never loads the element. Elastic ground beside an imprint has no
 * such depth: there the element gets no law. R: rotation of the foot. */
void slots_imprints(const FootScratch *foot, const Imprints *imprints, const Memory *memory,
                    const double *R);

#endif
