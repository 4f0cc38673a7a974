/* Friction must not create energy (docs/model.md section 17). */
#ifndef MILD_GROUND_ENERGY_H
#define MILD_GROUND_ENERGY_H

#include "ground/scratch.h"

#define ENERGY_ROUNDS 2 /* a step is solved again at most so often */

/* At the start of a step: no element's friction is turned. */
void energy_begin(MildScratch *scratch);
/* Bool: friction gave energy in the step just solved, which must be solved again. The elements
 * whose friction gave some are marked for it (Element.turn); with `all`, every element. */
int energy_created(MildScratch *scratch, const MildContactInput *input,
                   const MildContactResult *result, int all);

#endif
