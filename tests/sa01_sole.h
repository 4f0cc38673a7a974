#ifndef TESTS_SA01_SOLE_H
#define TESTS_SA01_SOLE_H

#include "sa01.h"

/* Outline of the left sole, robots/sa01/sa01.json: x, lowest y, highest y [m]; the right sole is
 * its mirror image. A second copy on purpose: tests of the ground cannot read a robot's folder, and
 * those of its reader compare with this. */
static const double sa01_outline[SA01_OUTLINE_ROWS][3] = {
    {-0.075, -0.013, 0.013}, {-0.06, -0.044, 0.044},  {-0.045, -0.045, 0.047},
    {-0.03, -0.046, 0.049},  {-0.015, -0.046, 0.051}, {0.0, -0.041, 0.041},
    {0.015, -0.041, 0.041},  {0.03, -0.041, 0.041},   {0.045, -0.041, 0.041},
    {0.06, -0.046, 0.057},   {0.075, -0.046, 0.057},  {0.09, -0.046, 0.057},
    {0.105, -0.046, 0.057},  {0.12, -0.046, 0.057},   {0.135, -0.046, 0.057},
    {0.15, -0.046, 0.057},   {0.165, -0.045, 0.049},  {0.18, -0.038, 0.039},
    {0.195, -0.016, 0.015}};

#endif
