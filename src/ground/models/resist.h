/* Resistive force theory under the elements (models ecc_quasi and ecc_quasi_3d). */
#ifndef MILD_GROUND_RESIST_H
#define MILD_GROUND_RESIST_H

#include "ground/law/plate.h"
#include "ground/step/scratch.h"

/* The law of a level plate moving straight down: F = zeta 1e6 N/m^3 u per area. */
Law resist_law(const MildMaterial *material, double pitch);
/* ModelRow.reference (model.h). Sets friction to 0, because the measured coefficients include the
 * friction of the plate. */
void resist_material(MildMaterial *material, double area);

/* ModelRow.direction for the 2D theory, in the vertical plane of motion, and for the 3D theory. */
void resist_plane(const FootScratch *foot, const MildTerrain *terrain, int model, double dt,
                  const double *rotation, const Motion *now);
void resist_space(const FootScratch *foot, const MildTerrain *terrain, int model, double dt,
                  const double *rotation, const Motion *now);

#endif
