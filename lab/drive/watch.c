#include "drive/runner.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Bounds: at least twice what walks show, with pushes of 1 m/s and the noise of training
 * (lab/drive/README.md, section 2). */
#define MEMORY 4.0       /* [s] of the sums. A robot that believes a drift falls after 2 to 7 s */
#define GAP 1.6          /* [-] of the usual way from state to state, beyond which one is missing */
#define PACE_SHARE 0.1   /* [-] of a state in what is usual */
#define REPEAT_TICKS 10  /* a repeated number is 0.1 s old: as old as a state that damps */
#define REPEAT_MOVED 0.2 /* [rad] of a target in that time: a robot that stands may repeat itself */
#define SPREAD_TICKS 8   /* before which the noise is not known */
#define TURN_SLACK 0.06  /* [rad] three times the rounding of an integral in steps of 10 ms */
#define TURN_NOISE 18    /* [-] deviations of a tick: noise adds up to 14 of them (sqrt(200)) */
#define TURN_STEP 0.05   /* [rad] a tick counts as no more, so that a heading may jump */
#define ANGLE_SLACK 0.11 /* [rad] */
#define ANGLE_NOISE 122  /* [-] of what speeds leave over, which is rare and small */
#define ANGLE_STEP 0.005 /* [rad] impacts are shorter than a period, and have both signs */

/* ---- numbers that repeat ---- */

/* same: bool. Of `joints` joints from `first` on, one whose target moves is enough. */
static void take_repeat(Repeat *r, int same, const float *target, int first, int joints) {
    if (!same) {
        r->ticks = 0;
        r->moved = 0;
        memcpy(r->target, target, sizeof r->target);
        return;
    }
    r->ticks++;
    for (int i = first; i < first + joints; i++) {
        r->moved = fmax(r->moved, fabs((double)target[i] - (double)r->target[i]));
    }
}

static int is_old(Watch *w, const Repeat *r, const char *name, char *why, size_t size) {
    const double share = fmin(r->ticks / (double)REPEAT_TICKS, r->moved / REPEAT_MOVED);
    w->share[WATCH_REPEAT] = fmax(w->share[WATCH_REPEAT], share);
    if (share < 1) {
        return 0;
    }
    snprintf(why, size, "%s repeated the same numbers for %.2f s, while targets moved by %.2f rad",
             name, r->ticks * TASK_PERIOD, r->moved);
    return 1;
}

static int is_equal(const float *a, const float *b, int count) {
    int equal = 1;
    for (int i = 0; i < count; i++) {
        equal &= a[i] == b[i];
    }
    return equal;
}

static int is_repeated(Watch *w, const Robot *robot, const StatePacket *state, const float *target,
                       char *why, size_t size) {
    const StatePacket *before = &w->before;
    const int joints = robot_joints(robot);
    const int same = is_equal(before->quaternion, state->quaternion, 4) &&
                     is_equal(before->angular_velocity, state->angular_velocity, 3);
    take_repeat(&w->imu, w->begun && same, target, 0, joints);
    int old = is_old(w, &w->imu, "the IMU", why, size);
    for (int i = 0; i < joints && !old; i++) {
        const int still = w->begun && before->angle[i] == state->angle[i];
        take_repeat(&w->joint[i], still, target, i, 1);
        old = is_old(w, &w->joint[i], robot_joint_name(robot, i), why, size);
    }
    return old;
}

/* ---- integrals ---- */

/* [-] The sum's share of its bound: a slack, and what noise of this size adds up to. */
static double add(const Watch *w, Disagreement *d, double by, double step, double slack,
                  double noise) {
    const double keep = 1 - TASK_PERIOD / MEMORY, counted = fmin(fmax(by, -step), step);
    d->sum = keep * d->sum + counted;
    d->squares = keep * d->squares + counted * counted;
    const double mean = d->sum / w->weight,
                 variance = fmax(d->squares / w->weight - mean * mean, 0);
    return w->weight < SPREAD_TICKS ? 0 : fabs(d->sum) / (slack + noise * sqrt(variance));
}

/* [rad] The way of the base from a to b, own axes; less than a radian. */
static void turn_between(const float a[4], const float b[4], double way[3]) {
    const double w = (double)a[0], x = -(double)a[1], y = -(double)a[2], z = -(double)a[3],
                 W = (double)b[0], X = (double)b[1], Y = (double)b[2], Z = (double)b[3];
    const double sign = w * W - x * X - y * Y - z * Z < 0 ? -2 : 2;
    way[0] = sign * (w * X + x * W + y * Z - z * Y);
    way[1] = sign * (w * Y - x * Z + y * W + z * X);
    way[2] = sign * (w * Z + x * Y - y * X + z * W);
}

static int is_turned(Watch *w, const StatePacket *state, char *why, size_t size) {
    double way[3];
    turn_between(w->before.quaternion, state->quaternion, way);
    for (int i = 0; i < 3; i++) {
        const double rate =
            ((double)w->before.angular_velocity[i] + (double)state->angular_velocity[i]) / 2;
        const double share =
            add(w, &w->turn[i], way[i] - TASK_PERIOD * rate, TURN_STEP, TURN_SLACK, TURN_NOISE);
        w->share[WATCH_TURN] = fmax(w->share[WATCH_TURN], share);
        if (share > 1) {
            snprintf(why, size, "the quaternion turned by %.2f rad about %c that the gyro denies",
                     fabs(w->turn[i].sum), "xyz"[i]);
            return 1;
        }
    }
    return 0;
}

/* [rad] The way of a joint that its speed does not explain: any speed between the two that were
 * measured would. At its stop a joint bounces within a period. */
static double denied_way(const Robot *robot, int i, const StatePacket *from,
                         const StatePacket *to) {
    const double low = robot_joint_low(robot)[i], high = robot_joint_high(robot)[i],
                 p = (double)from->angle[i], q = (double)to->angle[i],
                 a = TASK_PERIOD * (double)from->speed[i], b = TASK_PERIOD * (double)to->speed[i];
    if (fmin(p, q) < low || fmax(p, q) > high) {
        return 0;
    }
    return q - p - fmin(fmax(q - p, fmin(a, b)), fmax(a, b));
}

static int is_moved(Watch *w, const Robot *robot, const StatePacket *state, char *why,
                    size_t size) {
    for (int i = 0; i < robot_joints(robot); i++) {
        const double rest = denied_way(robot, i, &w->before, state);
        const double share = add(w, &w->angle[i], rest, ANGLE_STEP, ANGLE_SLACK, ANGLE_NOISE);
        w->share[WATCH_ANGLE] = fmax(w->share[WATCH_ANGLE], share);
        if (share > 1) {
            snprintf(why, size, "%s moved by %.2f rad that its speed denies",
                     robot_joint_name(robot, i), fabs(w->angle[i].sum));
            return 1;
        }
    }
    return 0;
}

/* Bool: a period after the state before. By the clock and by the count of states, because the clock
 * of a robot that is simulated in lockstep is not its time. */
static int is_next(Watch *w, const StatePacket *state) {
    const double passed = 1e-6 * (double)(state->time - w->before.time),
                 count = (double)(state->sequence - w->before.sequence);
    const double usual = w->pace > 0 ? w->pace : count;
    w->pace = usual + PACE_SHARE * (count - usual);
    return passed < GAP * TASK_PERIOD && count < GAP * usual;
}

int watch_disagrees(Watch *w, const Robot *robot, const SensorLimits *limits,
                    const StatePacket *state, const float *target, char *why, size_t size) {
    const int follows = w->begun && is_next(w, state);
    int differs = is_repeated(w, robot, state, target, why, size);
    if (follows) {
        w->weight = (1 - TASK_PERIOD / MEMORY) * w->weight + 1;
        differs = differs || (limits->turn > 0 && is_turned(w, state, why, size)) ||
                  (limits->speed > 0 && is_moved(w, robot, state, why, size));
    }
    w->before = *state;
    w->begun = 1;
    return differs;
}
