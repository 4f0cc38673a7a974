/* A contact step in the frames in which the feet press (law/frame.h): arms, twists, inverse inertia
 * and wrenches of a foot are in its frame until the results are written. */
#ifndef MILD_GROUND_STEP_FRAME_H
#define MILD_GROUND_STEP_FRAME_H

#include "ground/step/scratch.h"

/* Sets the frame of a foot by the ground under the point (0, 0, z) of its sole, and its levers. R:
 * [9] rotation of the foot. */
void foot_frame(FootScratch *foot, const MildTerrain *terrain, const double *R);
/* Twists or wrenches, two vectors, of the world in the frame of a foot, and back. The two may be
 * the same. */
void twist_of_world(const FootScratch *foot, const double *world, double *own);
void twist_to_world(const FootScratch *foot, const double *own, double *world);
/* The input in the frames of the listed feet, but for the poses: `input` itself where none has a
 * frame, else of the scratch. */
const MildContactInput *input_of_world(MildScratch *scratch, const MildContactInput *input);

#endif
