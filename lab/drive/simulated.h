/* A simulated robot that speaks packets: MuJoCo with our ground, PD on the newest targets at every
 * physics step. Its sensors have no noise. */
#ifndef DRIVE_SIMULATED_H
#define DRIVE_SIMULATED_H

#include "drive/packet.h"
#include "drive/udp.h"
#include "env/task/task.h"

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
