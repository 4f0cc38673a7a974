/* Python scripts draw the figures from CSV files that the program writes. */
#ifndef MILD_FIGURE_H
#define MILD_FIGURE_H

#include "mild/error.h"

/* Runs a shipped script ("scripts/fit.py") with the arguments `data`, `picture` and, unless it is
 * NULL, `title`. Uses the Python of .venv, or else the system's. */
MildStatus figure_draw(const char *script, const char *data, const char *picture, const char *title,
                       MildError *error);

#endif
