#include "drive/runner.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "control/speed_hold.h"
#include "identify/belief/file.h"

#define CLOCK_DRIFT 1e-3 /* [-] by which two clocks may run apart */
#define CLOCK_JUMP 1.0   /* [s] by which no state is faster than the fastest */
#define GREETING 1.0     /* [s] in which a sender must answer with this runner's session */
enum { GOOD = 5 };       /* states in a row before the first answer */

struct Runner {
    RunnerDef def;
    TaskDef task; /* without noise */
    PacketFormat format;
    SensorLimits limits;
    Controller controller;
    TaskEnv *env; /* its sensors are packets, its physics is elsewhere */
    SpeedHoldDef speed_hold;
    SpeedHold hold;
    int joints;
    PacketMode mode;

    /* the robot */
    uint64_t sender;  /* whose states are taken; 0: nobody's */
    uint64_t session; /* of that sender */
    double greeted;   /* [s] when its first state came */
    int good;         /* its good states in a row, up to GOOD */
    int confirmed;    /* bool: it knows this runner's session */
    int peer_ended;   /* bool */

    /* its states */
    StatePacket state; /* the newest that was in time and possible */
    uint32_t newest;   /* sequence of the newest, also of one that was late or impossible */
    int fresh;         /* bool: the policy has not seen `state` */
    double arrived;    /* [s] when it came */
    double fastest;    /* [s] smallest difference of arrival and sending, by two clocks */
    int glitches;      /* impossible ones since then */
    double glitch[2];  /* [s] when the first and the last of them came */
    char glitch_why[160];

    double ticked; /* [s] the last tick; negative: none since a robot is there */
    TargetPacket target;
    float action[ROBOT_JOINTS_MAX];
    RunnerReport report;
};

/* ---- creation ---- */

static TaskMotor motor_of(const Runner *r, int i) {
    return task_motor(r->env, &r->task, robot_table(r->def.robot), &task_env_rest(r->env)->gains,
                      i);
}

static void set_gains(Runner *r) {
    for (int i = 0; i < r->joints; i++) {
        const TaskMotor motor = motor_of(r, i);
        r->target.kp[i] = (float)motor.kp;
        r->target.kd[i] = (float)motor.kd;
        r->target.limit[i] = (float)(r->def.torque_share * motor.limit);
    }
}

/* An episode that nothing is drawn for: what the task's code needs of it. */
static void begin_episode(Runner *r) {
    const double still[3] = {0, 0, 0};
    task_env_init(r->env, &r->task, r->def.robot, 0, 0);
    r->env->command_frozen = 1;
    memcpy(r->env->command, still, sizeof still);
    task_env_draw(r->env, &r->task, r->def.robot);
    task_begin_episode(r->env, &r->task, robot_table(r->def.robot), 0, 0);
    r->env->phase = 0;
    r->hold = (SpeedHold){.cycles = {0}};
}

Runner *runner_create(const RunnerDef *def, MildError *error) {
    if (task_def_check_plain(def->task, "drive", error) != MILD_OK) {
        return NULL;
    }
    if (robot_actions(def->robot) < robot_joints(def->robot)) {
        mild_fail(error, MILD_ERROR_ARGUMENT,
                  "robot %s has joints that another program moves (driven in robot.ini), "
                  "and a packet's targets are of all joints",
                  robot_name(def->robot));
        return NULL;
    }
    Runner *r = calloc(1, sizeof *r);
    if (!r) {
        mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
        return NULL;
    }
    r->def = *def;
    r->task = *def->task;
    r->task.observe_noise = 0;
    r->joints = robot_joints(def->robot);
    r->format = (PacketFormat){r->joints, packet_robot(def->robot), def->key};
    r->limits = (SensorLimits){def->turn_limit, def->speed_limit, def->angle_limit};
    r->target.session = def->session;
    r->ticked = -1;
    belief_reset(&r->report.belief);
    const ControllerDef learned = {def->policy, &r->task, def->robot, NULL, 1};
    if (controller_make_learned(&learned, &r->controller, error) != MILD_OK) {
        free(r);
        return NULL;
    }
    r->speed_hold = speed_hold_def(&r->task, def->robot, &r->controller);
    r->env = aligned_alloc(64, task_env_bytes(&r->task, def->robot));
    if (!r->env) {
        runner_destroy(r);
        mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
        return NULL;
    }
    begin_episode(r);
    set_gains(r);
    return r;
}

void runner_destroy(Runner *runner) {
    if (runner) {
        controller_destroy(&runner->controller);
        free(runner->env);
        free(runner);
    }
}

/* ---- who speaks ---- */

static void forget_robot(Runner *r) {
    r->sender = r->session = 0;
    r->good = r->confirmed = r->fresh = r->glitches = 0;
}

/* Nobody keeps a runner waiting who falls silent or never answers it. */
static void check_greeting(Runner *r, double now) {
    if (r->sender && !r->confirmed &&
        (now - r->arrived > r->def.damp_after ||
         now - r->greeted > fmax(GREETING, r->def.damp_after))) {
        forget_robot(r);
    }
}

static int is_stranger(const Runner *r, uint64_t sender) {
    const uint64_t only = r->def.peer, any_port = only & RUNNER_PORT ? 0 : RUNNER_PORT;
    return (only && (sender | any_port) != (only | any_port)) || (r->sender && r->sender != sender);
}

/* Bool: the state belongs to the session with this robot, or greets while there is none. */
static int is_of_session(const Runner *r, const StatePacket *state) {
    if (r->confirmed) {
        return state->session == r->session && state->peer == r->def.session;
    }
    return state->session != 0 && (state->peer == 0 || state->peer == r->def.session);
}

/* ---- states ---- */

/* Bool: newer than all before it, by its number and by the robot's clock. */
static int is_newer(const Runner *r, const StatePacket *state) {
    return r->good == 0 ||
           ((int32_t)(state->sequence - r->newest) > 0 && state->time >= r->state.time);
}

/* [s] by which this state took longer than the fastest one. The clocks differ by what the fastest
 * packet shows, and drift. */
static double lateness(const Runner *r, const StatePacket *state, double now) {
    const double took = now - 1e-6 * (double)state->time;
    return r->good == 0 ? 0 : took - r->fastest - CLOCK_DRIFT * (now - r->arrived);
}

static void take_end(Runner *r, const StatePacket *state, double now) {
    if (r->confirmed && is_newer(r, state) && lateness(r, state, now) <= r->def.late) {
        r->peer_ended = 1;
    } else {
        r->report.ends_ignored++;
    }
}

/* Bool: refused, because it cannot be true. */
static int is_impossible(Runner *r, const StatePacket *state, double late, double now) {
    char *why = r->report.refusal;
    const size_t size = sizeof r->report.refusal;
    if (late < -CLOCK_JUMP) {
        snprintf(why, size, "its clock jumped forward by %.3g s", -late);
    } else if (!sensor_is_impossible(r->def.robot, &r->limits, r->good > 0 ? &r->state : NULL,
                                     state, why, size)) {
        return 0;
    }
    if (!r->confirmed) {
        forget_robot(r);
    }
    snprintf(r->glitch_why, sizeof r->glitch_why, "%s", why);
    r->glitch[r->glitches > 0] = now;
    r->glitches++;
    return 1;
}

static void use_state(Runner *r, const StatePacket *state, uint64_t sender, double now) {
    const double took = now - 1e-6 * (double)state->time;
    if (r->good == 0) {
        r->greeted = now;
        r->fastest = took;
    }
    r->fastest = fmin(took, r->fastest + CLOCK_DRIFT * (now - r->arrived));
    r->sender = sender;
    r->session = state->session;
    r->good += r->good < GOOD;
    r->confirmed = r->confirmed || (r->good == GOOD && state->peer == r->def.session);
    r->state = *state;
    r->arrived = now;
    r->fresh = 1;
    r->glitches = 0;
}

/* A state of the session, which is no end. */
static PacketFault take_state(Runner *r, const StatePacket *state, uint64_t sender, double now) {
    RunnerReport *report = &r->report;
    if (!r->confirmed && state->session != r->session) {
        forget_robot(r);
    }
    const int first = r->good == 0;
    const double late = lateness(r, state, now);
    if (!is_newer(r, state)) {
        report->received++;
        report->reordered++;
        return PACKET_FAULT_none;
    }
    report->lost += first ? 0 : (int32_t)(state->sequence - r->newest) - 1;
    r->newest = state->sequence;
    if (late <= r->def.late && is_impossible(r, state, late, now)) {
        return PACKET_FAULT_implausible;
    }
    report->received++;
    if (late > r->def.late) {
        report->late++;
    } else {
        use_state(r, state, sender, now);
    }
    return PACKET_FAULT_none;
}

PacketFault runner_take(Runner *r, const uint8_t *bytes, size_t size, uint64_t sender, double now) {
    RunnerReport *report = &r->report;
    StatePacket state;
    check_greeting(r, now);
    PacketFault fault = is_stranger(r, sender) ? PACKET_FAULT_stranger
                                               : packet_read_state(bytes, size, &r->format, &state);
    packet_explain(fault, bytes, &r->format, report->refusal, sizeof report->refusal);
    if (fault == PACKET_FAULT_none && !is_of_session(r, &state)) {
        fault = PACKET_FAULT_session;
    }
    if (fault == PACKET_FAULT_none && state.mode == PACKET_end) {
        take_end(r, &state, now);
    } else if (fault == PACKET_FAULT_none) {
        fault = take_state(r, &state, sender, now);
    }
    report->refused[fault] += fault != PACKET_FAULT_none;
    return fault;
}

/* ---- limits ---- */

void runner_damp(Runner *r, const char *why) {
    if (r->mode != PACKET_damp) {
        r->mode = PACKET_damp;
        snprintf(r->report.why, sizeof r->report.why, "%s", why);
    }
}

/* Damps a robot that has tipped over. */
static void check_tilt(Runner *r, const TaskSensors *reading) {
    char why[sizeof r->report.why];
    const double tilt = acos(fmin(fmax(-reading->gravity[2], -1), 1));
    if (tilt > r->task.tilt_limit) {
        snprintf(why, sizeof why, "the base is tilted by %.2f rad, the limit is %g", tilt,
                 r->task.tilt_limit);
        runner_damp(r, why);
    }
}

/* Damps a robot whose sensors do not agree. Before the first step there is no target. */
static void check_sensors(Runner *r) {
    char why[sizeof r->report.why];
    if (r->report.steps > 0 && watch_disagrees(&r->report.watch, r->def.robot, &r->limits,
                                               &r->state, r->target.angle, why, sizeof why)) {
        runner_damp(r, why);
    }
}

/* Damps when there was no usable state for too long, or no tick. */
static void check_times(Runner *r, double now) {
    char why[sizeof r->report.why];
    const double age = now - r->arrived, stall = r->ticked < 0 ? 0 : now - r->ticked,
                 glitch = r->glitches > 0 ? r->glitch[r->glitches > 1] - r->glitch[0] : 0;
    if (stall > r->def.stall_after) {
        snprintf(why, sizeof why, "the runner itself stood still for %.3f s, the limit is %g",
                 stall, r->def.stall_after);
        runner_damp(r, why);
    }
    if (glitch > r->def.glitch) {
        snprintf(why, sizeof why, "impossible states for %.3f s: %s", glitch, r->glitch_why);
        runner_damp(r, why);
    }
    if (age > r->def.damp_after) {
        snprintf(why, sizeof why, "no %sstate for %.3f s, the limit is %g",
                 r->glitches > 0 ? "possible " : "", age, r->def.damp_after);
        runner_damp(r, why);
    }
    r->ticked = now;
}

/* The target whose PD asks for no more than the limit at this angle and speed:
 * |kp (target - q) - kd qd| <= limit. */
static double limit_target(const TaskMotor *motor, double limit, double q, double qd) {
    const double wanted = motor->target[0];
    if (motor->kp <= 0) {
        return wanted;
    }
    const double low = q + (motor->kd * qd - limit) / motor->kp,
                 high = q + (motor->kd * qd + limit) / motor->kp;
    return fmin(fmax(wanted, low), high);
}

static void set_targets(Runner *r, const TaskSensors *reading) {
    for (int i = 0; i < r->joints; i++) {
        const TaskMotor motor = motor_of(r, i);
        const double limit = r->def.torque_share * motor.limit;
        const double target = limit_target(&motor, limit, reading->q[i], reading->qd[i]);
        r->report.targets_limited += target != motor.target[0];
        r->target.angle[i] = (float)target;
    }
}

/* ---- ticks ---- */

static double within(double x, double low, double high) {
    return !(x > low) ? low : x > high ? high : x; /* not a number: low */
}

/* Into the ranges of the task's commands. */
static void set_command(Runner *r, const double command[3]) {
    const TaskDef *t = &r->task;
    double *own = r->env->command;
    const double wanted = isfinite(command[0]) ? command[0] : 0;
    const int back = t->backward_share > 0;
    own[0] = within(wanted, back ? fmin(t->vx[0], t->backward_vx[0]) : t->vx[0],
                    back ? fmax(t->vx[1], t->backward_vx[1]) : t->vx[1]);
    own[1] = within(isfinite(command[1]) ? command[1] : 0, t->vy[0], t->vy[1]);
    own[2] = within(isfinite(command[2]) ? command[2] : 0, t->wz[0], t->wz[1]);
}

/* Bool: the policy's output is of use. */
static int is_finite(const Runner *r) {
    int finite = 1;
    for (int i = 0; i < r->joints; i++) {
        finite = finite && isfinite(r->action[i]);
    }
    return finite;
}

static void look_at_ground(Runner *r) {
    const float *frame = task_env_frame(r->env);
    if (r->def.belief) {
        belief_step(&r->report.belief, r->def.belief, frame);
    }
    if (r->def.log) {
        belief_log_print(r->def.log, (double)r->report.steps * TASK_PERIOD, frame);
    }
}

/* One step of the policy: as an environment's, but for its physics. A frame has the command of the
 * tick before it. */
static void step_policy(Runner *r, const TaskSensors *reading, const double command[3]) {
    const EnvsView none = {0};
    TaskSensors shown = *reading;
    sensor_clip(r->def.robot, &shown);
    if (r->report.steps == 0) {
        set_command(r, command);
        memcpy(r->env->command_seen, r->env->command, sizeof r->env->command);
    }
    task_env_observe(r->env, &r->task, r->def.robot, NULL, &shown, r->report.steps == 0, &none);
    look_at_ground(r);
    r->controller.act(r->controller.self, 1, &r->env, r->action);
    if (!is_finite(r)) {
        runner_damp(r, "the policy's action is not finite");
        return;
    }
    task_begin_step(r->env, &r->task, robot_table(r->def.robot), r->action);
    set_targets(r, reading);
    set_command(r, command);
    speed_hold(&r->hold, &r->speed_hold, task_env_frame(r->env),
               controller_estimates(&r->controller, 0), r->env->command);
    set_command(r, r->env->command);
    task_advance_clock(r->env, &r->task);
    r->report.steps++;
}

static void walk(Runner *r, double now, const double command[3]) {
    const TaskSensors reading = sensor_read(&r->state, r->joints);
    check_tilt(r, &reading);
    check_sensors(r);
    if (r->mode == PACKET_damp) {
        return;
    }
    r->mode = PACKET_walk;
    times_add(&r->report.age, now - r->arrived);
    step_policy(r, &reading, command);
}

/* Without stiffness in every mode in which the policy does not walk. */
static size_t write_target(Runner *r, double now, uint8_t *bytes) {
    r->target.mode = r->mode;
    r->target.sequence++;
    r->target.answers = r->state.sequence;
    r->target.time = (uint64_t)(1e6 * now);
    r->target.peer = r->session;
    TargetPacket packet = r->target;
    for (int i = 0; i < r->joints && r->mode != PACKET_walk && r->mode != PACKET_hold; i++) {
        packet.angle[i] = r->state.angle[i];
        packet.kp[i] = 0;
    }
    return packet_write_target(&packet, &r->format, bytes);
}

size_t runner_tick(Runner *r, double now, const double command[3], uint8_t *bytes) {
    const int fresh = r->fresh;
    r->fresh = 0;
    if (!r->confirmed) { /* no more packets than came */
        return r->good == GOOD && fresh && r->mode == PACKET_wait ? write_target(r, now, bytes) : 0;
    }
    check_times(r, now);
    if (r->mode == PACKET_damp) {
        r->report.damps++;
    } else if (fresh) {
        walk(r, now, command);
    } else {
        r->mode = PACKET_hold;
        r->report.holds++;
    }
    return write_target(r, now, bytes);
}

size_t runner_end(Runner *r, double now, uint8_t *bytes) {
    r->mode = PACKET_end;
    return r->good == GOOD ? write_target(r, now, bytes) : 0;
}

PacketMode runner_mode(const Runner *r) {
    return r->mode;
}

uint64_t runner_sender(const Runner *r) {
    return r->sender;
}

int runner_peer_ended(const Runner *r) {
    return r->peer_ended;
}

const RunnerReport *runner_report(const Runner *r) {
    return &r->report;
}

double times_edge(int bin) {
    return 1e-6 * pow(10, (double)bin / TIMES_DECADE);
}

void times_add(Times *times, double seconds) {
    const double place = seconds > 1e-6 ? floor(TIMES_DECADE * log10(seconds / 1e-6)) : 0;
    times->bin[place < TIMES_BINS - 1 ? (int)place : TIMES_BINS - 1]++;
    times->longest = fmax(times->longest, seconds);
    times->count++;
}

double times_quantile(const Times *times, double share) {
    long seen = 0;
    for (int i = 0; i < TIMES_BINS; i++) {
        seen += times->bin[i];
        if (seen > 0 && (double)seen >= share * (double)times->count) {
            return i < TIMES_BINS - 1 ? fmin(times_edge(i + 1), times->longest) : times->longest;
        }
    }
    return times->longest;
}
