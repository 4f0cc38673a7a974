/* Where the elements of a foot are, and which of them may touch the ground in a step. */
#ifndef MILD_GROUND_LOCATE_H
#define MILD_GROUND_LOCATE_H

#include "ground/scratch.h"

/* Computes the depth of every element. Where the ground differs from place to place, also its world
 * position, and on uneven ground the gradient under it. imprints: bool, the ground keeps imprints.
 * position, R: pose of the foot. */
void foot_locate(FootScratch *foot, const MildTerrain *terrain, int imprints,
                 const double *position, const double *R);
/* Depth of every element of a foot on uneven ground, and the gradient under it. */
void foot_surface(FootScratch *foot, const MildTerrain *terrain);
/* [m] Least depth at the start of the step of an element that may touch in it. */
double foot_least(const FootScratch *foot, const MildContactInput *input, double steepest, int f);
/* Lists the elements that may touch in this step, in ascending order. The common cases, all
 * elements or none, are found without a branch per element. steepest: upper bound [-] on the
 * gradient of the ground. f: index of the foot in `input`. */
void foot_list(FootScratch *foot, const MildContactInput *input, double steepest, int f);

#endif
