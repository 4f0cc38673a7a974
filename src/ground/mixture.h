/* Materials in the slots: the law of each slot is that of a material, or near a smooth border of a
 * mixture of two. */
#ifndef MILD_GROUND_MIXTURE_H
#define MILD_GROUND_MIXTURE_H

#include "ground/scratch.h"

/* Derives the laws of the terrain's materials. Those whose bytes have not changed are kept. */
void foot_laws(FootScratch *foot, const MildTerrain *terrain);
/* Gives each slot the law of the material that its element touched down on, so that a foot that
 * slides over a border keeps its law. An element in the air takes the material under it. */
void slots_materials(const FootScratch *foot, const MildTerrain *terrain, const Memory *memory);
/* Gives the padding no law: it makes no force at any depth. */
void slots_pad(const FootScratch *foot);

#endif
