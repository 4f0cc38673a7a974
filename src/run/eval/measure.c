#include "run/eval/measure.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "env/task/step.h"

/* The base's angular velocity and the joints' speeds are those of the end of the step. */
static void take_state(Smooth *s, const EnvsSample *after, int joints) {
    const double *w = after->omega;
    double joint = 0;
    for (int i = 0; i < joints; i++) {
        joint += after->speed[i] * after->speed[i];
    }
    s->tilt += w[0] * w[0] + w[1] * w[1];
    s->yaw += w[2] * w[2];
    s->joint += joint / joints;
    s->counted++;
}

static void take_target(Smooth *s, int counts, const double *target, int joints) {
    double jerk = 0, jump = 0;
    for (int i = 0; i < joints; i++) {
        const double change = target[i] - s->target[SMOOTH_JERK_STEPS - 1][i];
        jerk += change * change;
        jump = fmax(jump, fabs(target[i] - s->target[0][i]));
    }
    if (counts) {
        s->jerk += jerk / joints;
        s->jump = fmax(s->jump, jump);
        s->targets++;
    }
    memmove(s->target[1], s->target[0], (SMOOTH_JERK_STEPS - 1) * sizeof *s->target);
    memcpy(s->target[0], target, (size_t)joints * sizeof *target);
}

void smooth_take(Smooth *s, double from, double period, const EnvsSample *after, int joints,
                 const float *action, double scale, double clip) {
    const int counts = s->steps >= SMOOTH_JERK_STEPS && s->steps * period >= from;
    double target[ROBOT_JOINTS_MAX];
    if (counts) {
        take_state(s, after, joints);
    }
    if (action) {
        for (int i = 0; i < joints; i++) {
            target[i] = scale * fmin(fmax((double)action[i], -clip), clip);
        }
        take_target(s, counts, target, joints);
    }
    s->steps++;
}

void smooth_add(Smooth *sum, const Smooth *trial) {
    sum->counted += trial->counted;
    sum->targets += trial->targets;
    sum->tilt += trial->tilt;
    sum->yaw += trial->yaw;
    sum->joint += trial->joint;
    sum->jerk += trial->jerk;
    sum->jump = fmax(sum->jump, trial->jump);
}

/* Root of a mean; NaN of nothing. */
static double root(double sum, int count) {
    return count ? sqrt(sum / count) : NAN;
}

Smoothness smooth_result(const Smooth *sum) {
    return (Smoothness){.target_jump = sum->targets ? sum->jump : NAN,
                        .action_jerk = root(sum->jerk, sum->targets) / SMOOTH_JERK_UNIT,
                        .tilt_rate = root(sum->tilt, sum->counted),
                        .yaw_rate = root(sum->yaw, sum->counted),
                        .joint_speed = root(sum->joint, sum->counted)};
}

#define CONTACT_FORCE 5.0  /* [N] */
#define SWING_HEIGHT 0.005 /* [m] a lower lift does not count as a swing */
#define LEGS_MOST 1e6      /* [m] further apart: there are none */
#define TWO_PI 6.283185307179586
#define AT_LIMIT 0.99     /* [-] of the greatest torque */
#define CHATTER_TIME 0.03 /* [s] a shorter loss of contact does not end a stance */

double measure_yaw(const double q[4]) {
    return atan2(2 * (q[0] * q[3] + q[1] * q[2]), 1 - 2 * (q[2] * q[2] + q[3] * q[3]));
}

void measure_start(Measure *measure, double dt) {
    memset(measure, 0, sizeof *measure);
    measure->dt = dt;
    measure->base_low = 1e9;
    measure->base_high = -1e9;
    measure->legs = INFINITY;
    measure->up_since = NAN;
}

/* Bool: speed, cost and strides are measured at this time [s]. */
static int is_steady(const Measure *m, double time) {
    return time >= MEASURE_STEADY && (m->steady_end == 0 || time < m->steady_end);
}

/* A foot comes down at `time` [s]: a stride ends if the foot came down before, in the steady part.
 */
static void take_stride(Measure *m, int f, double time, const double *at) {
    const int steady = is_steady(m, time);
    if (m->landed[f] && steady) {
        m->stride_sum += hypot(at[0] - m->touchdown[f][0], at[1] - m->touchdown[f][1]);
        m->stride_time += time - m->began[f];
        m->strides++;
    }
    m->landed[f] = steady;
}

static void start_stance(Measure *m, int f, const double *at) {
    const double time = m->time - m->dt;
    take_stride(m, f, time, at);
    m->swing[f] = 0;
    if (m->apex[f] > SWING_HEIGHT) {
        m->apex_sum += m->swing[f] = m->apex[f];
        m->swings++;
    }
    m->in_stance[f] = 1;
    m->began[f] = time;
    m->touchdown[f][0] = m->last[f][0] = at[0];
    m->touchdown[f][1] = m->last[f][1] = at[1];
    m->deepest[f] = m->path[f] = m->hardest[f] = m->peak[f] = m->rise[f] = 0;
}

static void keep_stance(Measure *m, const MeasureStance *stance) {
    if (m->stances == m->room) {
        MeasureStance *more = m->stances == 0 || m->kept
                                  ? realloc(m->kept, (size_t)(2 * m->room + 16) * sizeof *more)
                                  : NULL;
        if (!more) {
            free(m->kept);
        }
        m->kept = more;
        m->room = 2 * m->room + 16;
    }
    if (m->kept) {
        m->kept[m->stances] = *stance;
    }
}

static void end_stance(Measure *m, int f) {
    const double x = m->last[f][0] - m->touchdown[f][0], y = m->last[f][1] - m->touchdown[f][1];
    const double c = cos(m->yaw), s = sin(m->yaw);
    const MeasureStance stance = {.foot = f,
                                  .start = m->began[f],
                                  .duration = m->lasted[f],
                                  .depth = m->deepest[f],
                                  .way = {c * x + s * y, c * y - s * x},
                                  .apex = m->swing[f],
                                  .at = {m->touchdown[f][0], m->touchdown[f][1]},
                                  .torque = m->hardest[f]};
    m->in_stance[f] = 0;
    m->deepest_sum += stance.depth;
    m->peak_sum += m->peak[f];
    m->rise_sum += m->rise[f];
    m->drift_sum += hypot(x, y);
    m->path_sum += m->path[f];
    m->way_sum[0] += fabs(stance.way[0]);
    m->way_sum[1] += fabs(stance.way[1]);
    if (m->keep) {
        keep_stance(m, &stance);
    }
    m->stances++;
}

/* [N] By which the load on the foot has risen in MEASURE_RISE. */
static double take_rise(Measure *m, int f, double load) {
    const int steps = (int)lround(fmin(fmax(MEASURE_RISE / m->dt, 1), MEASURE_RISE_STEPS));
    double *oldest = &m->recent[f][m->samples % steps];
    const double rise = load - *oldest;
    *oldest = load;
    return rise;
}

static void measure_foot(Measure *m, int f, const EnvsFoot *foot) {
    const double rise = take_rise(m, f, foot->load);
    if (foot->load > CONTACT_FORCE) {
        if (!m->in_stance[f]) {
            start_stance(m, f, foot->center);
        }
        m->air_time[f] = m->apex[f] = 0;
        m->path[f] += hypot(foot->center[0] - m->last[f][0], foot->center[1] - m->last[f][1]);
        m->hardest[f] = fmax(m->hardest[f], m->torque);
        m->peak[f] = fmax(m->peak[f], foot->load);
        m->rise[f] = fmax(m->rise[f], rise);
        m->last[f][0] = foot->center[0];
        m->last[f][1] = foot->center[1];
        m->lasted[f] = m->time - m->began[f];
        m->deepest[f] = fmax(m->deepest[f], foot->depth);
        return;
    }
    m->air_time[f] += m->dt;
    m->apex[f] = fmax(m->apex[f], foot->height);
    if (m->in_stance[f] && m->air_time[f] > CHATTER_TIME) {
        end_stance(m, f);
    }
}

/* Bool: the motor of joint i gives all that it can at the speed at which it computed the torque. */
static int is_limited(const Measure *m, int i, double torque) {
    const TaskMotor *motor = &m->motor[i];
    const double most =
        torque * m->speed[i] < 0 ? (double)motor->limit : task_torque_most(motor, m->speed[i]);
    return fabs(torque) >= AT_LIMIT * most;
}

static void measure_motors(Measure *m, const EnvsSample *sample) {
    for (int i = 0; i < sample->joints; i++) {
        m->joint_speed = fmax(m->joint_speed, fabs(sample->speed[i]));
        m->torque_square[i] += sample->torque[i] * sample->torque[i] * m->dt;
        m->limited[i] += m->motor && is_limited(m, i, sample->torque[i]) ? m->dt : 0;
    }
}

static void measure_contact(Measure *m, const EnvsSample *sample) {
    int standing = 0;
    for (int f = 0; f < sample->feet; f++) {
        standing += sample->foot[f].load > CONTACT_FORCE;
    }
    const int flies = !standing && sample->shell_load <= CONTACT_FORCE;
    m->flight += flies ? m->dt : 0;
    if (flies) {
        m->flight_apex =
            m->flying > 0 ? fmax(m->flight_apex, sample->mass_center[2]) : sample->mass_center[2];
    } else if (m->flying >= MEASURE_FLIGHT) {
        m->flights++;
        m->flight_rise += m->flight_apex - m->settled;
    }
    m->flying = flies ? m->flying + m->dt : 0;
    m->stance += standing * m->dt / sample->feet;
}

/* The steady part starts at the position of the base before its first step, so that distance and
 * time match. */
static void measure_steady(Measure *m, const EnvsSample *sample, double yaw, double power_abs) {
    if (m->steady_time == 0) {
        memcpy(m->start, m->base, sizeof m->start);
        m->flying = NAN; /* a flight that is under way does not count */
    }
    memcpy(m->end, sample->base, sizeof m->end);
    double x = sample->base[0] - m->base[0], y = sample->base[1] - m->base[1];
    double c = cos(m->yaw), s = sin(m->yaw);
    m->way[0] += c * x + s * y;
    m->way[1] += c * y - s * x;
    m->turned += remainder(yaw - m->yaw, TWO_PI);
    m->steady_time += m->dt;
    m->work += power_abs * m->dt;
    m->base_low = fmin(m->base_low, sample->above);
    m->base_high = fmax(m->base_high, sample->above);
    measure_motors(m, sample);
    measure_contact(m, sample);
}

/* Bool: tilt and height are those of a robot that stands. */
static int is_up(const Measure *m, const EnvsSample *sample) {
    const double *q = sample->quaternion;
    double soles = 0;
    for (int f = 0; f < sample->feet; f++) {
        soles += sample->foot[f].height / sample->feet;
    }
    return 1 - 2 * (q[1] * q[1] + q[2] * q[2]) > cos(MEASURE_UP_TILT) &&
           sample->above - soles > MEASURE_UP_HEIGHT * m->nominal_height;
}

void measure_sample(Measure *m, const EnvsSample *sample) {
    const double yaw = measure_yaw(sample->quaternion);
    double power = 0, power_abs = 0;
    m->torque = 0;
    for (int i = 0; i < sample->joints; i++) {
        double joint_power = sample->torque[i] * sample->speed[i];
        power += joint_power;
        power_abs += fabs(joint_power);
        m->torque = fmax(m->torque, fabs(sample->torque[i]));
    }
    m->torque_max = fmax(m->torque_max, m->torque);
    m->energy += fabs(power) * m->dt;
    if (is_steady(m, m->time)) {
        measure_steady(m, sample, yaw, power_abs);
    }
    m->time += m->dt;
    if (m->time < MEASURE_SETTLED) {
        m->settled = sample->mass_center[2];
    } else {
        m->legs = fmin(m->legs, sample->legs);
    }
    m->shell_load += sample->shell_load * m->dt;
    m->load += sample->shell_load * m->dt;
    memcpy(m->base, sample->base, sizeof m->base);
    m->yaw = yaw;
    if (!is_up(m, sample)) {
        m->up_since = NAN;
    } else if (isnan(m->up_since)) {
        m->up_since = m->time;
    }
    for (int f = 0; f < sample->feet; f++) {
        m->load += sample->foot[f].load * m->dt;
        measure_foot(m, f, &sample->foot[f]);
    }
    memcpy(m->speed, sample->speed, sizeof m->speed);
    m->samples++;
}

void measure_step(Measure *measure, const TaskEnv *env, const RobotSim *sim, const double *torque) {
    EnvsSample sample;
    envs_read_sample(env, sim, torque, &sample);
    measure_sample(measure, &sample);
}

void measure_finish(Measure *m) {
    int lifted = m->stances > 0;
    for (int f = 0; f < ROBOT_FEET_MAX && !lifted; f++) {
        if (m->in_stance[f]) {
            end_stance(m, f);
        }
    }
}

double measure_up(const Measure *m) {
    return m->time - m->up_since >= MEASURE_UP_TIME ? m->up_since : NAN;
}

double measure_shells(const Measure *m) {
    return m->load > 0 ? m->shell_load / m->load : 0;
}

double measure_legs(const Measure *m) {
    return m->legs < LEGS_MOST ? m->legs : NAN;
}

void measure_free(Measure *measures, int count) {
    for (int i = 0; measures && i < count; i++) {
        free(measures[i].kept);
    }
    free(measures);
}
