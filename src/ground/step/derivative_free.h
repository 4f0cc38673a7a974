/* How the law of a step depends on the free motion, for derivative.c. */
#ifndef MILD_GROUND_DERIVATIVE_FREE_H
#define MILD_GROUND_DERIVATIVE_FREE_H

#include "ground/step/scratch.h"

/* block: dP/dV^ [kg, kg m, kg m^2] of the impulses on foot f at fixed twists, in its frame. Where
 * it stops in virgin ground, drag starts at a speed that the free motion raises (element_drag);
 * ground that creates energy (passive = false) is explicit (element_explicit). Both are forces that
 * follow the descent, so with g = (-slope, 1), c = g + d friction/dI_z and k = dI_z/dw of the free
 * motion it is the sum of -k (B^T c) (B^T g)^T, as H is of h of pass.c. twist: V of the foot,
 * world. */
void foot_free(const FootScratch *foot, const MildContactInput *input, int f, const double *twist,
               double block[36]);

#endif
