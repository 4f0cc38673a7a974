/* Fills the slots of a foot with where its listed elements are and what they remember. */
#ifndef MILD_GROUND_GATHER_H
#define MILD_GROUND_GATHER_H

#include "ground/scratch.h"

/* All elements are listed and the ground keeps no imprints: the slots are the arrays of the
 * elements themselves. */
void slots_direct(FootScratch *foot, const Memory *memory);
/* Copies the listed elements side by side. */
void slots_gather(FootScratch *foot, const Memory *memory);

/* Slope and depth of the slots on uneven ground. before: bool, it was uneven in the last step too.
 * height: of the terrain [m].
 *
 * A step replaces the ground under an element by its tangent plane. Where the ground rises faster
 * than the plane, the element would be deeper after the step without having been pressed down, and
 * so gain energy. Therefore an element that stays in the ground starts at the depth below the plane
 * of the last step when that is less. */
void slots_uneven(const FootScratch *foot, int32_t before, const Memory *memory, double height);
/* Sets the slopes back to 0 when a foot has left uneven ground. On level ground nothing writes
 * them. */
void slots_level(const FootScratch *foot);

/* Greatest depth of the elements that carry nothing: that of the imprint under them. Below h0,
 * within an imprint, it is at least the depth whose unloading line ends where the element is; so
 * moving sideways in an imprint never loads it. R: rotation of the foot. */
void slots_imprints(const FootScratch *foot, const Imprints *imprints, const Memory *memory,
                    const double *R);

#endif
