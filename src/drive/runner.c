#include "drive/runner.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CLOCK_DRIFT 1e-3 /* [-] by which two clocks may run apart */

struct Runner {
    RunnerDef def;
    TaskDef task; /* without noise */
    Controller controller;
    TaskEnv *env; /* its sensors are packets, its physics is elsewhere */
    PacketMode mode;
    StatePacket state; /* the newest that was in time */
    uint32_t newest;   /* sequence of the newest, also of one that was late */
    int joints;
    int fresh;           /* bool: the policy has not seen it */
    int peer_ended;      /* bool */
    double arrived;      /* [s] when it came */
    double fastest;      /* [s] smallest difference of arrival and sending, by two clocks */
    TargetPacket target; /* the last */
    float action[ROBOT_JOINTS_MAX];
    RunnerReport report;
};

/* ---- creation ---- */

static void set_gains(Runner *r) {
    for (int i = 0; i < r->joints; i++) {
        const TaskMotor motor = task_motor(r->env, &r->task, r->def.robot, i);
        r->target.kp[i] = (float)motor.kp;
        r->target.kd[i] = (float)motor.kd;
        r->target.limit[i] = (float)(r->def.torque_share * motor.limit);
    }
}

/* An episode that nothing is drawn for: what the task's text needs of it. */
static void begin_episode(Runner *r) {
    const double still[3] = {0, 0, 0};
    task_env_init(r->env, &r->task, r->def.robot, 0, 0);
    r->env->command_frozen = 1;
    memcpy(r->env->command, still, sizeof still);
    task_randomize(r->env, &r->task, r->def.robot);
    task_begin_episode(r->env, &r->task, r->def.robot, 0);
    r->env->phase = 0;
}

Runner *runner_create(const RunnerDef *def, MildError *error) {
    Runner *r = calloc(1, sizeof *r);
    if (!r) {
        mild_fail(error, MILD_ERROR_MEMORY, "out of memory");
        return NULL;
    }
    r->def = *def;
    r->task = *def->task;
    r->task.observe_noise = 0;
    r->joints = robot_joints(def->robot);
    if (controller_learned(def->policy, def->robot, NULL, 1, &r->controller, error) != MILD_OK) {
        free(r);
        return NULL;
    }
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

/* ---- states ---- */

/* Bool: this state took longer than the fastest by more than `late`. The clocks differ by what the
 * fastest packet shows, and drift. */
static int is_late(Runner *r, const StatePacket *state, double now) {
    const double took = now - 1e-6 * (double)state->time;
    if (r->report.received == 0) {
        r->fastest = took;
    }
    r->fastest = fmin(took, r->fastest + CLOCK_DRIFT * (now - r->arrived));
    return took - r->fastest > r->def.late;
}

PacketFault runner_take(Runner *r, const uint8_t *bytes, size_t size, double now) {
    RunnerReport *report = &r->report;
    StatePacket state = {0};
    const PacketFault fault = packet_read_state(bytes, size, r->joints, &state);
    if (fault != PACKET_FAULT_none) {
        report->refused[fault]++;
        return fault;
    }
    r->peer_ended = r->peer_ended || state.mode == PACKET_end;
    const int32_t ahead = (int32_t)(state.sequence - r->newest);
    const int late = is_late(r, &state, now);
    const int first = report->received++ == 0;
    if (!first && ahead <= 0) {
        report->reordered++;
        return fault;
    }
    report->lost += first ? 0 : ahead - 1;
    r->newest = state.sequence;
    if (late) {
        report->late++;
        return fault;
    }
    r->state = state;
    r->arrived = now;
    r->fresh = 1;
    return fault;
}

/* Minus the third row of the rotation that the quaternion stands for. */
static TaskReading read_state(const StatePacket *state, int joints) {
    TaskReading reading = {{0}, {0}, {0}, {0}};
    const double w = (double)state->quaternion[0], x = (double)state->quaternion[1],
                 y = (double)state->quaternion[2], z = (double)state->quaternion[3];
    reading.gravity[0] = -2 * (x * z - w * y);
    reading.gravity[1] = -2 * (y * z + w * x);
    reading.gravity[2] = 2 * (x * x + y * y) - 1;
    for (int i = 0; i < 3; i++) {
        reading.omega[i] = (double)state->angular_velocity[i];
    }
    for (int i = 0; i < joints; i++) {
        reading.q[i] = (double)state->angle[i];
        reading.qd[i] = (double)state->speed[i];
    }
    return reading;
}

/* ---- limits ---- */

void runner_damp(Runner *r, const char *why) {
    if (r->mode != PACKET_damp) {
        r->mode = PACKET_damp;
        snprintf(r->report.why, sizeof r->report.why, "%s", why);
    }
}

/* Damps a robot that is beyond what its joints and the task allow. */
static void check_robot(Runner *r, const TaskReading *reading) {
    const Robot *robot = r->def.robot;
    char why[sizeof r->report.why];
    for (int i = 0; i < r->joints; i++) {
        const double q = reading->q[i], qd = fabs(reading->qd[i]);
        const double beyond = fmax(robot_joint_low(robot)[i] - q, q - robot_joint_high(robot)[i]);
        if (r->def.speed_limit > 0 && qd > r->def.speed_limit) {
            snprintf(why, sizeof why, "%s moves at %.1f rad/s, the limit is %g",
                     robot_joint_name(robot, i), qd, r->def.speed_limit);
            runner_damp(r, why);
        }
        if (r->def.angle_limit >= 0 && beyond > r->def.angle_limit) {
            snprintf(why, sizeof why, "%s is %.2f rad beyond its range, the limit is %g",
                     robot_joint_name(robot, i), beyond, r->def.angle_limit);
            runner_damp(r, why);
        }
    }
    const double tilt = acos(fmin(fmax(-reading->gravity[2], -1), 1));
    if (tilt > r->task.tilt_limit) {
        snprintf(why, sizeof why, "the base is tilted by %.2f rad, the limit is %g", tilt,
                 r->task.tilt_limit);
        runner_damp(r, why);
    }
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

static void set_targets(Runner *r, const TaskReading *reading) {
    for (int i = 0; i < r->joints; i++) {
        const TaskMotor motor = task_motor(r->env, &r->task, r->def.robot, i);
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

/* One step of the policy: as an environment's, but for its physics. A frame has the command of the
 * tick before it. */
static void step_policy(Runner *r, const TaskReading *reading, const double command[3]) {
    const TaskView none = {0};
    if (r->report.steps == 0) {
        set_command(r, command);
        memcpy(r->env->command_seen, r->env->command, sizeof r->env->command);
    }
    task_observe(r->env, &r->task, r->def.robot, NULL, reading, r->report.steps == 0, &none);
    r->controller.act(r->controller.self, 1, &r->env, r->action);
    if (!is_finite(r)) {
        runner_damp(r, "the policy's action is not finite");
        return;
    }
    task_begin_step(r->env, &r->task, r->action);
    set_targets(r, reading);
    set_command(r, command);
    task_advance_clock(r->env, &r->task);
    r->report.steps++;
}

static void walk(Runner *r, double now, const double command[3]) {
    const TaskReading reading = read_state(&r->state, r->joints);
    check_robot(r, &reading);
    if (r->mode == PACKET_damp) {
        return;
    }
    r->mode = PACKET_walk;
    r->fresh = 0;
    times_add(&r->report.age, now - r->arrived);
    step_policy(r, &reading, command);
}

static size_t write_target(Runner *r, double now, uint8_t *bytes) {
    r->target.mode = r->mode;
    r->target.sequence++;
    r->target.answers = r->state.sequence;
    r->target.time = (uint64_t)(1e6 * now);
    for (int i = 0; i < r->joints && r->mode >= PACKET_damp; i++) {
        r->target.angle[i] = r->state.angle[i];
        r->target.kp[i] = 0;
    }
    return packet_write_target(&r->target, r->joints, bytes);
}

size_t runner_tick(Runner *r, double now, const double command[3], uint8_t *bytes) {
    char why[sizeof r->report.why];
    if (r->report.received == 0) {
        return 0;
    }
    if (now - r->arrived > r->def.damp_after) {
        snprintf(why, sizeof why, "no state for %.3f s, the limit is %g", now - r->arrived,
                 r->def.damp_after);
        runner_damp(r, why);
    }
    if (r->mode == PACKET_damp) {
        r->report.damps++;
    } else if (r->fresh) {
        walk(r, now, command);
    } else {
        r->mode = PACKET_hold;
        r->report.holds++;
    }
    return write_target(r, now, bytes);
}

size_t runner_end(Runner *r, double now, uint8_t *bytes) {
    r->mode = PACKET_end;
    return write_target(r, now, bytes);
}

PacketMode runner_mode(const Runner *r) {
    return r->mode;
}

int runner_peer_ended(const Runner *r) {
    return r->peer_ended;
}

const RunnerReport *runner_report(const Runner *r) {
    return &r->report;
}
