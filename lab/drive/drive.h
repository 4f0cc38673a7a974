/* A runner at the end of a socket, every TASK_PERIOD, until the robot ends, time is over, or a
 * signal comes. */
#ifndef DRIVE_DRIVE_H
#define DRIVE_DRIVE_H

#include "drive/input.h"
#include "drive/runner.h"
#include "drive/udp.h"

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
