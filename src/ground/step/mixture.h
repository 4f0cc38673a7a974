/* Materials of the slots. A slot has the law of one material or, near a smooth border, of a mixture
 * of two. */
#ifndef MILD_GROUND_MIXTURE_H
#define MILD_GROUND_MIXTURE_H

#include "ground/step/scratch.h"

/* Derives the laws of the terrain's materials. Laws of materials whose bytes have not changed are
 * kept. */
void foot_laws(FootScratch *foot, const MildTerrain *terrain);
/* What a material or a mixture of two gives element e of a foot. derived: [MILD_MATERIALS_MAX] */
SlotLaw mixture_law(const FootScratch *foot, const DerivedLaw *derived, int32_t mixture, int e);
/* Gives each slot the law of the material that its element touched down on, so that a foot that
 * slides across a border keeps its law. An element in the air takes the material under it. */
void slots_materials(const FootScratch *foot, const MildTerrain *terrain, const Memory *memory);
/* Gives the padding a law without force at any depth. */
void slots_pad(const FootScratch *foot);

#endif
