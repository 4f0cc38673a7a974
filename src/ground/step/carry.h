/* The share of its load that each slot of a foot carries. */
#ifndef MILD_GROUND_CARRY_H
#define MILD_GROUND_CARRY_H

#include "ground/step/scratch.h"

/* Sets the share of this step and what follows from it, after slots_begin. For ground with
 * LAW_HEAP. */
void foot_carry(const FootScratch *foot, const Motion *now, double dt);
/* The force of ground without memory under each slot [N], into the working array fx. */
void slots_elastic(const FootScratch *foot);

#endif
