/* The solvers of the equations of a step, V+ = V_free + A W(V+) (docs/model.md section 7). They
 * leave the impulses in the slots and the wrenches in the scratch, and set velocity, residual,
 * iterations and converged of the result. */
#ifndef MILD_GROUND_SOLVER_H
#define MILD_GROUND_SOLVER_H

#include "ground/step/scratch.h"

/* Newton's method on the feet's twists. */
void newton_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result);
/* The paper's Algorithm 1: sweeps over the elements. With MILD_SOLVER_EXPLICIT to the letter: the
 * normal impulses are those of the depths and speeds before the step, friction alone is swept, and
 * drift resistance follows; there is no memory. */
void sweep_solve(MildScratch *scratch, const MildContactInput *input, MildContactResult *result);

#endif
