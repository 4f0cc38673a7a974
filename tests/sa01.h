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

#endif
