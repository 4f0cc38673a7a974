/* From numbers of a material to the law of an element: what the models are built from. */
#ifndef MILD_GROUND_MATERIAL_H
#define MILD_GROUND_MATERIAL_H

#include "ground/law.h"
#include "mild/ground.h"

#define LAW_PI 3.14159265358979323846
/* [N/m^3] stiffness of the firm bed per area: 0.4 mm more for a robot on ten elements. */
#define LAW_BED_STRESS 5e7
/* [N/m^3] of a level plate going straight down at zeta = 1 (Li et al. 2013). */
#define LAW_RESIST_STRESS 1e6

/* F = slope u over the bed. area: of the element [m^2]. */
Law law_line(double slope, double area, double bed_depth);
/* A yielding spring: F = k_pen u going down; up to that at rest, 0 going up, within the elastic
 * travel. */
Law law_spring(const MildMaterial *material, double pitch);
/* Its ModelRow.reference (model.h). */
void law_spring_material(MildMaterial *material, double area);
/* The developing cone of the material under one element of area pitch^2. */
Law law_cone(const MildMaterial *material, double pitch);
/* LawCurve bits of a law. */
int law_curves(const Law *law);
/* Bool: a number of it is none. */
int law_is_nan(const Law *law);
/* [-] share of the depth that springs back: all of it where the law has no memory, else the
 * material's. */
double law_recovery(const Law *law, double recovery);
/* Every number of the law changes linearly from a to b. A mean of two passive laws is passive: it
 * has c_d m >= m/2 too. */
Law law_between(const Law *a, const Law *b, double share);

#endif
