/* Figures are drawn by Python scripts from a CSV that the program wrote. */
#ifndef MILD_FIGURE_H
#define MILD_FIGURE_H

#include "mild/error.h"

/* Runs a shipped script ("scripts/fit.py") with `data` and `picture` as arguments, in the private
 * environment, else with the system's Python. */
MildStatus figure_draw(const char *script, const char *data, const char *picture, MildError *error);

#endif
