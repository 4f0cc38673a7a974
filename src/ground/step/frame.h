/* The frame in which a sole presses (docs/model.md section 21): its axes are those of the ground,
 * turned by a share of the angle between ground and sole. */
#ifndef MILD_GROUND_FRAME_H
#define MILD_GROUND_FRAME_H

#include "ground/step/scratch.h"

#define FRAME_TURN 0.6 /* [-] share of the angle */

/* Sets the frame of a plane sole whose slots have their material, and turns its arms into it. R: [9]
 * rotation of the foot. */
void foot_frame(FootScratch *foot, const double *R);
/* A twist or a wrench, two vectors of the world, in the frame of the foot, and back. */
void frame_from_world(const FootScratch *foot, const double *world, double *own);
void frame_to_world(const FootScratch *foot, const double *own, double *world);
/* The input in the frames of the listed feet, but for the poses: `input` itself where none has a
 * frame, else of the scratch. */
const MildContactInput *contact_in_frames(MildScratch *scratch, const MildContactInput *input);

#endif
