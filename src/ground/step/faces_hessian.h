/* The hessian of a surface. */
#ifndef MILD_GROUND_FACES_HESSIAN_H
#define MILD_GROUND_FACES_HESSIAN_H

#include "ground/step/scratch.h"

/* After a pass: that of pass.c with p = sum over four factors (1, x, y, height). H: [36]. */
void faces_hessian(const FootScratch *foot, double *H);

#endif
