/* Sizes of robots/sa01, the robot that most tests use: written by hand, a second time on purpose:
 * what the code counts from robot.ini must be this. */
#ifndef TESTS_SA01_H
#define TESTS_SA01_H

#define SA01 MILD_SOURCE_DIR "/robots/sa01"

enum {
    SA01_LEFT = 0,
    SA01_RIGHT = 1,
    SA01_JOINTS = 12,
    SA01_FEET = 2,
    SA01_NQ = 19,
    SA01_NV = 18,
    SA01_OBSERVATION = 47,
    SA01_HISTORY = 6 * 47,
    SA01_ESTIMATES = 11,
    SA01_CRITIC = 104,
    SA01_OUTLINE_ROWS = 19
};

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
