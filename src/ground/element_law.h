/* Laws of an element from the numbers of a material: what the models are built from. */
#ifndef MILD_GROUND_ELEMENT_LAW_H
#define MILD_GROUND_ELEMENT_LAW_H

#include "ground/law.h"
#include "mild/ground.h"

#define LAW_PI 3.14159265358979323846
/* [N/m^3] Stiffness of the firm bed per area: a robot on ten elements sinks 0.4 mm into it. */
#define LAW_BED_STRESS 5e7
/* [N/m^3] Stress per depth on a level plate that goes straight down at zeta = 1 (Li et al.
 * 2013). */
#define LAW_RESIST_STRESS 1e6

/* [m] u_f of a law without a cone: complete at once. Only a blend with a cone reads it. */
#define LAW_LINE_DEPTH 1e-9

/* F = slope u above the bed. area: of the element [m^2]. */
Law law_line(double slope, double area, double bed_depth);
/* A yielding spring: F = k_pen u on the way down. With recovery 0 the force is anything up to that
 * at rest and 0 on the way up, but for the elastic travel. */
Law law_spring(const MildMaterial *material, double pitch);
/* Its ModelRow.reference (model.h). */
void law_spring_material(MildMaterial *material, double area);
/* The developing cone of the material under one element of area pitch^2. */
Law law_cone(const MildMaterial *material, double pitch);
/* LawCurve bits of a law. */
int law_curves(const Law *law);

#endif
