/* Builds the law of an element from the numbers of a material. The models use these functions. */
#ifndef MILD_GROUND_ELEMENT_LAW_H
#define MILD_GROUND_ELEMENT_LAW_H

#include "ground/law/law.h"
#include "mild/ground.h"

#define LAW_PI 3.14159265358979323846
/* [N/m^3] Stiffness of the firm bed per area. A robot on ten elements sinks 0.4 mm into it. */
#define LAW_BED_STRESS 5e7
/* [N/m^3] Stress per depth on a level plate moving straight down, for zeta = 1 (Li et al. 2013). */
#define LAW_RESIST_STRESS 1e6

/* [m] u_f of a law without a cone, which is thus complete at once. Only a blend with a cone uses
 * it. */
#define LAW_LINE_DEPTH 1e-9

/* F = slope u above the bed. area: of the element [m^2]. */
Law law_line(double slope, double area, double bed_depth);
/* A yielding spring: F = k_pen u on the way down. With recovery 0, apart from the elastic travel,
 * the force at rest is anything from 0 to that, and on the way up it is 0. */
Law law_spring(const MildMaterial *material, double pitch);
/* Its ModelRow.reference (model.h). */
void law_spring_material(MildMaterial *material, double area);
/* The developing cone of the material under one element of area pitch^2. */
Law law_cone(const MildMaterial *material, double pitch);
/* LawCurve bits of a law. */
int law_curves(const Law *law);
/* Bool: one of its numbers is NaN. */
int law_is_nan(const Law *law);
/* [-] Share of the depth that springs back: 1 for a law without memory, else the material's. */
double law_recovery(const Law *law, double recovery);
/* Interpolates every number of the law linearly from a to b. The mean of two passive laws is
 * passive, because it satisfies c_d m >= m/2 as well. */
Law law_between(const Law *a, const Law *b, double share);

#endif
