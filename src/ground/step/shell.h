/* Shells (docs/model.md, section 20): elements with a height, a normal and an area each. */
#ifndef MILD_GROUND_SHELL_H
#define MILD_GROUND_SHELL_H

#include "ground/step/scratch.h"

/* After foot_locate: lists the elements that face down and may touch in this step. steepest, f: as
 * in foot_list. */
void shell_list(FootScratch *foot, const MildTerrain *terrain, const MildContactInput *input,
                double steepest, int f);
/* Gives the slots their elements, material and ground, as foot_prepare does for a plane sole. now:
 * motion at the start of the step. Imprints take the elements for level squares. */
void shell_slots(FootScratch *foot, const MildGround *ground, int f, const MildTerrain *terrain,
                 const Memory *memory, const Motion *now, double dt);
/* The rotation that imprints take for that of a shell. */
extern const double shell_level[9];

/* [N s m] Sum of the heights times the normal impulses. *area: [m^2] of the loaded elements. */
double shell_loaded(const FootScratch *foot, double *area);

#endif
