/* Resistive force theory under the elements (models ecc_quasi and ecc_quasi_3d). */
#ifndef MILD_GROUND_RESIST_H
#define MILD_GROUND_RESIST_H

#include "ground/scratch.h"

#define RESIST_REST 1e-3 /* [m/s] speed below which the direction of motion fades out */
/* [-] Upper bound on alpha_z in both theories, whose largest values are 1 (2D, level plate,
 * straight down) and 1.076 (3D, at 27 degrees). */
#define RESIST_PEAK 1.08

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
