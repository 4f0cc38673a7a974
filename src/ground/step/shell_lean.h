/* The rim of a shell (rim.h). */
#ifndef MILD_GROUND_SHELL_LEAN_H
#define MILD_GROUND_SHELL_LEAN_H

#include "ground/step/scratch.h"

/* What the rim leaves of the load of each slot of a shell, into `lean`, and the ground ahead of
 * it, into `ahead`. On ground with LAW_HEAP. */
void shell_lean(const FootScratch *foot, const Motion *now);

#endif
