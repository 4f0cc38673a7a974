#include "eval/measure.h"

#include <math.h>
#include <string.h>

#define CONTACT_FORCE 5.0  /* [N] */
#define SWING_HEIGHT 0.005 /* [m] a lift lower than this is no swing: sensor of chatter */

void measure_start(Measure *measure, double dt) {
    memset(measure, 0, sizeof *measure);
    measure->dt = dt;
    measure->base_low = 1e9;
    measure->base_high = -1e9;
}

static void end_stance(Measure *m, int f, double x, double y) {
    m->deepest_sum += m->deepest[f];
    m->drift_sum += hypot(x - m->touchdown[f][0], y - m->touchdown[f][1]);
    m->stances++;
}

static void measure_foot(Measure *m, int f, const RobotFoot *foot, int rigid) {
    int contact = foot->force[2] > CONTACT_FORCE;
    double x = foot->sole_center[0], y = foot->sole_center[1];
    if (contact && !m->in_stance[f]) {
        if (m->apex[f] > SWING_HEIGHT) {
            m->apex_sum += m->apex[f];
            m->swings++;
        }
        m->touchdown[f][0] = x;
        m->touchdown[f][1] = y;
        m->deepest[f] = 0;
    } else if (!contact && m->in_stance[f]) {
        end_stance(m, f, x, y);
        m->apex[f] = 0;
    }
    m->in_stance[f] = contact;
    m->last[f][0] = x;
    m->last[f][1] = y;
    if (contact) {
        m->deepest[f] = fmax(m->deepest[f], rigid ? 0 : foot->result.depth_max);
    } else {
        m->apex[f] = fmax(m->apex[f], foot->sole_height);
    }
}

void measure_step(void *measure, const TaskEnv *env, const RobotSim *sim, const double *torque) {
    Measure *m = measure;
    const double *qd = robot_sim_qvel(sim) + 6, *qpos = robot_sim_qpos(sim);
    double power = 0, power_abs = 0;
    for (int i = 0; i < ROBOT_JOINTS; i++) {
        power += torque[i] * qd[i];
        power_abs += fabs(torque[i] * qd[i]);
        m->torque_max = fmax(m->torque_max, fabs(torque[i]));
    }
    m->energy += fabs(power) * m->dt;
    m->time += m->dt;
    if (m->time >= MEASURE_STEADY) {
        if (m->steady_time == 0) {
            m->start_x = qpos[0];
        }
        m->steady_time += m->dt;
        m->end_x = qpos[0];
        m->work += power_abs * m->dt;
        m->base_low = fmin(m->base_low, qpos[2]);
        m->base_high = fmax(m->base_high, qpos[2]);
    }
    for (int f = 0; f < ROBOT_FEET; f++) {
        measure_foot(m, f, robot_sim_foot(sim, f), env->variation.rigid);
    }
}

void measure_finish(Measure *m) {
    int lifted = m->stances > 0;
    for (int f = 0; f < ROBOT_FEET && !lifted; f++) {
        if (m->in_stance[f]) {
            end_stance(m, f, m->last[f][0], m->last[f][1]);
        }
    }
}
