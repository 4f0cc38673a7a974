/* Resistive force theory under the elements (models ecc_quasi and ecc_quasi_3d). */
#ifndef MILD_GROUND_RESIST_H
#define MILD_GROUND_RESIST_H

#include "ground/scratch.h"

#define RESIST_REST 1e-3 /* [m/s] speed below which the direction of motion fades out */
/* Greatest alpha_z of both theories: 1 (2D, level, straight down), 1.076 (3D, 27 degrees). */
#define RESIST_PEAK 1.08

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
