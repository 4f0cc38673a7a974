/* Resistive force theory under the elements (models ecc_quasi and ecc_quasi_3d). */
#ifndef MILD_GROUND_RESIST_H
#define MILD_GROUND_RESIST_H

#include "ground/scratch.h"

/* F = zeta 1e6 N/m^3 u per area under a level plate that goes straight down. */
Law resist_law(const MildMaterial *material, double pitch);
/* ModelRow.reference (model.h): the plate's friction is part of the measured coefficients. */
void resist_material(MildMaterial *material, double area);

/* ModelRow.direction of the theory in the plane of motion and in space. */
void resist_plane(const FootScratch *foot, const MildTerrain *terrain, int model, double dt,
                  const double *rotation, const Motion *now);
void resist_space(const FootScratch *foot, const MildTerrain *terrain, int model, double dt,
                  const double *rotation, const Motion *now);

#endif
