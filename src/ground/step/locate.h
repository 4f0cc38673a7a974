/* Where the elements of a foot are, and which of them may touch the ground in a step. */
#ifndef MILD_GROUND_LOCATE_H
#define MILD_GROUND_LOCATE_H

#include "ground/step/scratch.h"

/* Sets origin, arms and `uneven` from the pose. */
void foot_set_pose(FootScratch *foot, const MildTerrain *terrain, const double *position,
                   const double *R);
/* Computes the depth of every element of a plane sole after foot_set_pose. Where the ground differs
 * from place to place, also its world position, and on uneven ground the gradient under it.
 * imprints: bool, the ground keeps imprints. */
void foot_locate(FootScratch *foot, const MildTerrain *terrain, int imprints);
/* Depth of every element of a foot on uneven ground, and the gradient under it. */
void foot_surface(FootScratch *foot, const MildTerrain *terrain);
/* [m] Least depth at the start of the step of an element that may touch in it. */
double foot_least(const FootScratch *foot, const MildContactInput *input, double steepest, int f);
/* Bool: no element can touch in this step, seen from the bounding box. Sets least, reach and away.
 * After foot_set_pose. steepest: upper bound [-] on the gradient of the ground. */
int foot_is_away(FootScratch *foot, const MildTerrain *terrain, const MildContactInput *input,
                 double steepest, int f);
/* Lists the elements that may touch in this step, in ascending order. The common cases, all
 * elements or none, are found without a branch per element. steepest: upper bound [-] on the
 * gradient of the ground. f: index of the foot in `input`. */
void foot_list(FootScratch *foot, const MildContactInput *input, double steepest, int f);

#endif
