/* Where commands come from: keys of the terminal, a gamepad of Linux (joydev), or the command
 * line. */
#ifndef DRIVE_INPUT_H
#define DRIVE_INPUT_H

#include <termios.h>

#include "mild/error.h"

#define INPUT_KEYS                                                                                 \
    "w s: 0.1 m/s more or less; a d: turn 0.1 rad/s more to the left or right; q e: 0.1 m/s more " \
    "to the left or right; space: stand; x: damp and end"

typedef struct {
    int keys;        /* bool: standard input is a terminal whose keys count */
    int gamepad;     /* descriptor; -1: none */
    int rested[4];   /* bool, by axis: the stick has been at rest, and counts from then on */
    double range[3]; /* m/s, m/s, rad/s of a full stick */
    double command[3];
    struct termios before; /* the terminal's settings */
} Input;

/* gamepad: /dev/input/js0 or NULL. keys: bool, take them if there is a terminal. */
MildStatus input_open(Input *input, const double command[3], const double range[3], int keys,
                      const char *gamepad, MildError *error);
/* Reads what has come and never waits. Returns 1 when the robot shall damp, else 0. A gamepad or a
 * terminal that is gone commands to stand. */
int input_poll(Input *input);
void input_close(Input *input); /* restores the terminal */

#endif
