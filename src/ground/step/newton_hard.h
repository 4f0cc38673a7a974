/* Newton's method for steps that plain steps do not solve. */
#ifndef MILD_GROUND_NEWTON_HARD_H
#define MILD_GROUND_NEWTON_HARD_H

#include "ground/step/newton_step.h"

/* For steps on which plain Newton diverges because the bounds depend on I_z, or cycles over kinks
 * of the law. Alternate: minimise with the friction bounds fixed, move the bounds towards those at
 * the minimum, and try plain steps from there. Every BOUNDS_PATIENCE rounds, restart from bounds
 * several times as wide. Returns the number of steps. */
int newton_patient(const System *system, MildScratch *scratch, Point *best, int limit);
/* Chooses what to return for a step that the search has left unsolved. Its best point may be far
 * from a solution even with a small residual: its impulses may be zero deep in the ground. The
 * alternative is a minimum at fixed friction bounds, taken from the normal impulses without
 * friction. There every normal impulse obeys the law at the new velocity, and only the friction
 * bound does not. Returns the candidate closer to the law in `scratch` and `result`, and the number
 * of steps as the value. */
int newton_unsolved(const System *system, MildScratch *scratch, const Point *best,
                    MildContactResult *result);

#endif
