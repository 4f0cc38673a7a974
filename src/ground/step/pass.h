/* A pass: the impulses of all elements at trial twists of the feet, and their derivatives. */
#ifndef MILD_GROUND_PASS_H
#define MILD_GROUND_PASS_H

#include "ground/step/scratch.h"

/* Computes the impulse of every slot at the twists V, its derivatives, and the wrenches of the
 * feet. twist: [6 listed] of the listed feet, in their order. */
void contact_pass(MildScratch *scratch, double dt, const double *twist);
/* The same with the friction bounds fixed at slot.bound. The impulses are then minus the gradient
 * of a convex function of V. */
void contact_pass_held(MildScratch *scratch, double dt, const double *twist);
/* Computes the hessians of the feet from the derivatives of the last pass. */
void contact_hessian(MildScratch *scratch);

#endif
