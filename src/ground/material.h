/* From a material to the law of an element. */
#ifndef MILD_GROUND_MATERIAL_H
#define MILD_GROUND_MATERIAL_H

#include "ground/law.h"
#include "mild/ground.h"

#define LAW_PI 3.14159265358979323846
/* [N/m^3] stiffness of the firm bed per area: 0.4 mm more for a robot on ten elements. */
#define LAW_BED_STRESS 5e7
/* [N/m^3] of a level plate going straight down at zeta = 1 (Li et al. 2013). */
#define LAW_RESIST_STRESS 1e6

/* Law of one element of area pitch^2. */
Law law_of(const MildMaterial *material, double pitch);
/* Its LawCurve bits. */
int law_curves(const Law *law);
/* Bool: resistive force theory (resist.h). */
int model_is_resistive(int model);

#endif
