/* Runs a policy for a robot that it knows by packets alone. Time is given by the caller, and there
 * is no socket here: udp.h and drive.h have those.
 *
 *   wait  until a robot is there: GOOD states in a row of one sender and one session. From then on
 *         each state is answered by a target of mode wait, which carries the runner's session
 *   walk  a tick with a new state, which carries the runner's session: one step of the policy
 *   hold  a tick without one: the last targets again, no step
 *   damp  the newest usable state is older than damp_after, impossible ones came for longer than
 *         `glitch`, the sensors do not agree, the robot is tilted beyond the limit, or a tick was
 *         late by the runner's own fault: for good */
#ifndef DRIVE_RUNNER_H
#define DRIVE_RUNNER_H

#include <stdio.h>

#include "control/controller.h"
#include "drive/packet.h"
#include "drive/times.h"
#include "drive/watch.h"
#include "identify/belief/belief.h"

typedef struct {
    const char *policy;  /* file */
    const Robot *robot;  /* borrowed */
    const TaskDef *task; /* borrowed; nominal, as of experiment_task */
    double late;         /* [s] a state that took so much longer than the fastest one is not used */
    double damp_after;   /* [s] age of the newest state */
    double stall_after;  /* [s] between two ticks */
    double glitch;       /* [s] for which impossible states may come */
    double turn_limit;   /* [rad/s] of the base; 0: none. A state beyond this or the next two limits
                            is impossible, and one that differs from that before by more than they
                            allow */
    double speed_limit;  /* [rad/s] of a joint; 0: none */
    double angle_limit;  /* [rad] beyond the joint's range; negative: no limit */
    double torque_share; /* [-] of the task's torque limit, in (0, 1] */
    uint64_t session;    /* of this runner, a fresh random number, not 0 */
    uint64_t peer;       /* only this sender is heard; 0: the first; port 0: any of the host */
    const Key *key;      /* borrowed; NULL: none */
    const BeliefNet *belief; /* borrowed; what the robot knows of its ground; NULL: nothing */
    FILE *log;               /* borrowed; the frames that the policy sees (belief/log.h); NULL */
} RunnerDef;
/* A sender: address and port (udp_sender). */
#define RUNNER_PORT 0xffffu

/* Counts since the start. */
typedef struct {
    long received; /* states that were not refused */
    long refused[PACKET_FAULTS];
    long ends_ignored;    /* packets of mode end that were old, late, or of no robot that walks */
    long lost;            /* missing in the sequence, some of which may have come late */
    long reordered;       /* older than one before them */
    long late;            /* took too long */
    long steps;           /* of the policy */
    long holds;           /* ticks without a new state */
    long damps;           /* ticks */
    long targets_limited; /* of single joints */
    Watch watch;          /* how far the sensors agree */
    Times age;            /* of the state used in a step, since it arrived */
    Belief belief;        /* with RunnerDef.belief */
    char why[240];        /* the reason for damping; "": none */
    char refusal[160];    /* why the newest packet was refused; "": it was not, or no more to say */
} RunnerReport;

typedef struct Runner Runner;
Runner *runner_create(const RunnerDef *def, MildError *error);
void runner_destroy(Runner *runner); /* may be NULL */

/* A packet that arrived from `sender`, which is not 0. now [s] of the caller's clock, which never
 * goes back. */
PacketFault runner_take(Runner *runner, const uint8_t *bytes, size_t size, uint64_t sender,
                        double now);
/* A tick, every TASK_PERIOD. command: m/s, m/s, rad/s, brought into the task's ranges. Writes the
 * packet to send [PACKET_MAX] and returns its size; 0: nothing to send yet. */
size_t runner_tick(Runner *runner, double now, const double command[3], uint8_t *bytes);
/* From now on damp. */
void runner_damp(Runner *runner, const char *why);
/* The last packet: the runner ends. Its size is 0 when no robot is there. */
size_t runner_end(Runner *runner, double now, uint8_t *bytes);
PacketMode runner_mode(const Runner *runner);
/* Whose states are taken; 0: nobody's yet. */
uint64_t runner_sender(const Runner *runner);
/* Bool: the robot has said that it ends. */
int runner_peer_ended(const Runner *runner);
const RunnerReport *runner_report(const Runner *runner);

#endif
