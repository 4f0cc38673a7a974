/* Friction must not create energy (docs/model.md section 17). */
#ifndef MILD_GROUND_ENERGY_H
#define MILD_GROUND_ENERGY_H

#include "ground/step/scratch.h"

#define ENERGY_ROUNDS 2 /* a step is solved again at most this often */

/* At the start of a step: clears the reversal velocities (Element.turn_x, turn_y). */
void energy_begin(MildScratch *scratch);
/* Bool: friction created energy in the step just solved, and the step must be solved again. Sets
 * the reversal velocity of the elements whose friction did so, or with `all` of every element. */
int energy_created(MildScratch *scratch, const MildContactInput *input,
                   const MildContactResult *result, int all);

#endif
