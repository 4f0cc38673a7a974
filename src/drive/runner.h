/* Runs a policy for a robot that it knows by packets alone. Time is given by the caller, and there
 * is no socket here: udp.h and drive.h have those.
 *
 *   wait  until the first state
 *   walk  a tick with a new state: one step of the policy
 *   hold  a tick without one: the last targets again, no step
 *   damp  the newest state is older than damp_after, or the robot is beyond a limit: for good */
#ifndef DRIVE_RUNNER_H
#define DRIVE_RUNNER_H

#include "control/controller.h"
#include "drive/packet.h"
#include "drive/times.h"

typedef struct {
    const char *policy;  /* file */
    const Robot *robot;  /* borrowed */
    const TaskDef *task; /* borrowed; nominal, as of experiment_task */
    double late;         /* [s] a state that took so much longer than the fastest one is not used */
    double damp_after;   /* [s] age of the newest state */
    double speed_limit;  /* [rad/s] of a joint; 0: none */
    double angle_limit;  /* [rad] beyond the joint's range; negative: no limit */
    double torque_share; /* [-] of the task's torque limit, in (0, 1] */
} RunnerDef;

/* Counts since the start. */
typedef struct {
    long received; /* states that were not refused */
    long refused[PACKET_FAULTS];
    long lost;      /* missing in the sequence, some of which may have come late */
    long reordered; /* older than one before them */
    long late;
    long steps;           /* of the policy */
    long holds;           /* ticks without a new state */
    long damps;           /* ticks */
    long targets_limited; /* of single joints */
    Times age;            /* of the state used in a step, since it arrived */
    char why[160];        /* the reason for damping; "": none */
} RunnerReport;

typedef struct Runner Runner;
Runner *runner_create(const RunnerDef *def, MildError *error);
void runner_destroy(Runner *runner); /* may be NULL */

/* A packet that arrived. now [s] of the caller's clock, which never goes back. */
PacketFault runner_take(Runner *runner, const uint8_t *bytes, size_t size, double now);
/* A tick, every TASK_PERIOD. command: m/s, m/s, rad/s, brought into the task's ranges. Writes the
 * packet to send [PACKET_MAX] and returns its size; 0: nothing to send yet. */
size_t runner_tick(Runner *runner, double now, const double command[3], uint8_t *bytes);
/* From now on damp. */
void runner_damp(Runner *runner, const char *why);
/* The last packet: the runner ends. */
size_t runner_end(Runner *runner, double now, uint8_t *bytes);
PacketMode runner_mode(const Runner *runner);
/* Bool: the robot has said that it ends. */
int runner_peer_ended(const Runner *runner);
const RunnerReport *runner_report(const Runner *runner);

#endif
