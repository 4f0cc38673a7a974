/* What MILD_SOLVER_EXPLICIT does instead of the implicit sweep: Algorithm 1 of the paper to the
 * letter. */
#ifndef MILD_GROUND_LITERAL_H
#define MILD_GROUND_LITERAL_H

#include "ground/step/scratch.h"

/* Eqs 3 to 5: dt F_GM [N s] of the depth and the downward speed w before the step, on the way up
 * too. */
double literal_normal(const Slots *s, int i, int curves, double dt, double w);
/* Eq 13 of a cone without anything else, at the velocity v. delta: [m/s] continuity error. G:
 * [1/kg] entry of B A B^T. */
void literal_friction(Slots *s, int i, const double *v, const double *delta, double G);
/* Eq 14: drift resistance against the velocity before the step. */
void literal_drift(const MildScratch *scratch, const MildContactInput *input);

#endif
