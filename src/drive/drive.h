/* A runner at the end of a socket, every TASK_PERIOD, until the robot ends, time is over, or a
 * signal comes. */
#ifndef DRIVE_DRIVE_H
#define DRIVE_DRIVE_H

#include "drive/input.h"
#include "drive/runner.h"
#include "drive/udp.h"

typedef struct {
    Runner *runner;
    Udp *udp;       /* without a peer: the first sender of a state that is not refused becomes it */
    Input *input;   /* of commands */
    double seconds; /* [s] since the first state; 0: no end */
} DriveDef;

typedef struct {
    double seconds; /* [s] since the first state */
    long ticks;
    long missed;     /* ticks that were left out, because one before them took too long */
    long strangers;  /* packets of others than the peer */
    Times wakeup;    /* of a tick, after its time */
    Times compute;   /* from waking up to the packet sent */
    Times reply;     /* from a state's arrival to the packet sent */
    const char *end; /* what ended it: "time", "signal", "robot", "damped" */
} DriveReport;

void drive_run(const DriveDef *def, DriveReport *report);

#endif
