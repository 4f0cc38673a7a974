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
#include "env/task/task.h"
#include "identify/belief/belief.h"

/* ---- a histogram of durations from 1 us to 100 s ---- */

enum { TIMES_DECADE = 24, TIMES_BINS = 8 * TIMES_DECADE }; /* each bin 10 % wide */

typedef struct {
    long count, bin[TIMES_BINS];
    double longest; /* [s] */
} Times;

void times_add(Times *times, double seconds);
/* [s] Upper end of the bin where this share of the durations is reached, at most the longest; 0
 * when there are none. */
double times_quantile(const Times *times, double share);
/* [s] Lower end of a bin; index TIMES_BINS: upper end of the last. */
double times_edge(int bin);

/* ---- sensor.c: whether what sensors say can be true, and what the policy is shown of it ---- */

typedef struct {
    double turn;  /* [rad/s] of the base; 0: none */
    double speed; /* [rad/s] of a joint; 0: none */
    double angle; /* [rad] of a joint beyond its range; negative: none */
} SensorLimits;

/* Bool: a number is beyond its limit, or has changed since the state `before` (NULL: there is
 * none) by more than the speeds of the two allow in that time. `why` names the number. */
int sensor_is_impossible(const Robot *robot, const SensorLimits *limits, const StatePacket *before,
                         const StatePacket *state, char *why, size_t size);

TaskSensors sensor_read(const StatePacket *state, int joints);
/* Brings the reading into the range that the training of the shipped policies sees
 * (lab/drive/README.md, section 2). */
void sensor_clip(const Robot *robot, TaskSensors *reading);

/* ---- watch.c: whether sensors agree ---- */

/* With time, because a number that repeats is old, and with each other, because an angle is the
 * integral of its speed. Each state alone may be possible (sensor.c). */

typedef enum { WATCH_REPEAT, WATCH_TURN, WATCH_ANGLE, WATCH_CHECKS } WatchCheck;

/* Sums over the states whose weight falls by 1/e in 4 s. */
typedef struct {
    double sum, squares;
} Disagreement;

/* Bits that stay the same. */
typedef struct {
    int ticks;                      /* for so many */
    double moved;                   /* [rad] the way of a target from where it was then */
    float target[ROBOT_JOINTS_MAX]; /* [rad] then */
} Repeat;

/* Of one robot; zeros before the first state. */
typedef struct {
    int begun; /* bool */
    StatePacket before;
    double pace;                          /* [-] states that the robot sends in a period */
    double weight;                        /* of the states */
    Disagreement turn[3];                 /* [rad] the quaternion beside the gyro, own axes */
    Disagreement angle[ROBOT_JOINTS_MAX]; /* [rad] angles beside speeds */
    Repeat imu, joint[ROBOT_JOINTS_MAX];
    double share[WATCH_CHECKS]; /* [-] of a bound, the largest so far; a fault is above 1 */
} Watch;

/* A tick with a new state. target: [joints] the newest one sent. Bool: the sensors do not agree.
 * `why` says which. A limit of 0 (turn, speed) turns off the check of what it is of. */
int watch_disagrees(Watch *watch, const Robot *robot, const SensorLimits *limits,
                    const StatePacket *state, const float *target, char *why, size_t size);

/* ---- runner.c ---- */

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
    FILE *log;               /* borrowed; the frames that the policy sees (belief/file.h); NULL */
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
