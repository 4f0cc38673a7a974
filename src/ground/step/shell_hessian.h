/* The hessian of a shell. */
#ifndef MILD_GROUND_SHELL_HESSIAN_H
#define MILD_GROUND_SHELL_HESSIAN_H

#include "ground/step/scratch.h"

/* After a pass: that of pass.c with p = sum over four factors (1, x, y, height). H: [36]. */
void shell_hessian(const FootScratch *foot, double *H);

#endif
