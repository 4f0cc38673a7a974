/* A pass: the impulses of all elements at trial twists of the feet, and their derivatives. */
#ifndef MILD_GROUND_PASS_H
#define MILD_GROUND_PASS_H

#include "ground/scratch.h"

/* Impulses of every slot at the twists V, their derivatives and the feet's wrenches. twist: of the
 * loaded feet, from row `first` on. */
void contact_pass(MildScratch *scratch, double dt, const double *twist, int first);
/* The same with the bounds of friction held at slot.bound. The impulses are then minus the gradient
 * of a convex function. */
void contact_pass_held(MildScratch *scratch, double dt, const double *twist, int first);
/* The feet's hessians from the derivatives of the last pass. */
void contact_hessian(MildScratch *scratch);

#endif
