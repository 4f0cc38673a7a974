/* The two ends of a socket: a runner, every TASK_PERIOD, until the robot ends, time is over, or a
 * signal comes; and a simulated robot. */
#ifndef DRIVE_DRIVE_H
#define DRIVE_DRIVE_H

#include <termios.h>

#include "drive/packet.h"
#include "drive/runner.h"
#include "drive/udp.h"
#include "env/task/task.h"
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

/* ---- simulated.c ---- */

/* A simulated robot that speaks packets: MuJoCo with our ground, PD on the newest targets at every
 * physics step. Its sensors have no noise. */

typedef struct {
    const Robot *robot;         /* borrowed */
    const TaskDef *task;        /* borrowed; nominal */
    const MildTerrain *terrain; /* borrowed */
    int rigid;                  /* bool: the engine's own contact */
    const Udp *udp;             /* with a peer */
    double seconds;             /* [s] of its own time, after the first target */
    int lockstep; /* bool: one state a policy period, and time stands still until it is answered, at
                      most `patience`; else states at every physics step, in real time */
    double patience;    /* [s] */
    double drop;        /* [-] share of the states that are lost */
    double delay_share; /* [-] share of the states that are sent `delay` too late */
    double delay;       /* [s] */
    uint64_t seed;      /* of its start, of what is lost */
    uint64_t session;   /* a fresh random number, not 0 */
    const Key *key;     /* borrowed; NULL: none */
} SimulatedDef;

typedef struct {
    double seconds; /* [s] walked, its own time */
    double way[2];  /* [m] from the start to the end, world x and y */
    double rate;    /* [-] its own time over real time */
    int fallen;     /* bool */
    double damped;  /* [s] without stiffness, by command or because no target came */
    long sent, dropped, delayed;
    long targets, refused;
    long strangers;  /* packets of others than the peer */
    const char *end; /* "time", "fallen", "runner", "diverged", "silence" */
} SimulatedReport;

MildStatus simulated_run(const SimulatedDef *def, SimulatedReport *report, MildError *error);

#endif
