/* Resistive force theory under the elements (models ecc_quasi and ecc_quasi_3d). */
#ifndef MILD_GROUND_RESIST_H
#define MILD_GROUND_RESIST_H

#include "ground/scratch.h"

/* After foot_begin: the law of the foot's resistive slots for the way they move at the start of
 * the step. rotation: of the foot; now: how it moves. */
void slots_resist(const FootScratch *foot, const MildTerrain *terrain, double dt,
                  const double *rotation, const Motion *now);

#endif
