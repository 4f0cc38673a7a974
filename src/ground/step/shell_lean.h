/* The rim of a shell, and of a sole that is tilted (rim.h). */
#ifndef MILD_GROUND_SHELL_LEAN_H
#define MILD_GROUND_SHELL_LEAN_H

#include "ground/step/scratch.h"

/* What the water line leaves of the load of each slot of a sole: `lean`, until then the cosine
 * between sole and ground. On ground with LAW_HEAP. */
void soles_lean(const FootScratch *foot);
/* What the rim leaves of the load of each slot of a shell, into `lean`, and the ground ahead of
 * it, into `ahead`. On ground with LAW_HEAP. */
void shell_lean(const FootScratch *foot, const Motion *now);

#endif
