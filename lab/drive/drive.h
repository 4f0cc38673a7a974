/* A runner at the end of a socket, every TASK_PERIOD, until the robot ends, time is over, or a
 * signal comes. */
#ifndef DRIVE_DRIVE_H
#define DRIVE_DRIVE_H

#include <termios.h>

#include "drive/runner.h"
#include "drive/udp.h"
#include "mild/error.h"

/* ---- input.c: commands from keys, a gamepad of Linux (joydev), or the command line ---- */

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

/* ---- drive.c ---- */

typedef struct {
    Runner *runner;
    Udp *udp;                             /* its peer is whom the runner hears */
    Input *input;                         /* of commands */
    double seconds;                       /* [s] since the first target; 0: no end */
    void (*refused)(const char *refusal); /* once for each kind of refusal that has a remedy */
} DriveDef;

typedef struct {
    double seconds; /* [s] since the first target */
    long ticks;
    long missed;     /* ticks that were left out, because one before them took too long */
    Times wakeup;    /* of a tick, after its time */
    Times compute;   /* from waking up to the packet sent */
    Times reply;     /* from a state's arrival to the packet sent */
    const char *end; /* what ended it: "time", "signal", "robot", "damped" */
} DriveReport;

/* From now on SIGINT, SIGTERM, SIGHUP, SIGQUIT and SIGTSTP end the run, with packets that say so,
 * and a broken pipe ends nothing. Before input_open, so that the terminal is always restored. */
void drive_catch_signals(void);
void drive_run(const DriveDef *def, DriveReport *report);

#endif
