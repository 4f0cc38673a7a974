#include "eval/measure.h"

#include <math.h>
#include <string.h>

#define CONTACT_FORCE 5.0  /* [N] */
#define SWING_HEIGHT 0.005 /* [m] a lift lower than this is no swing */
#define CHATTER_TIME 0.03  /* [s] a shorter loss of contact does not end a stance */

void measure_start(Measure *measure, double dt) {
    memset(measure, 0, sizeof *measure);
    measure->dt = dt;
    measure->base_low = 1e9;
    measure->base_high = -1e9;
}

static void start_stance(Measure *m, int f, const double *at) {
    if (m->apex[f] > SWING_HEIGHT) {
        m->apex_sum += m->apex[f];
        m->swings++;
    }
    m->in_stance[f] = 1;
    m->touchdown[f][0] = at[0];
    m->touchdown[f][1] = at[1];
    m->deepest[f] = 0;
}

static void end_stance(Measure *m, int f) {
    m->in_stance[f] = 0;
    m->deepest_sum += m->deepest[f];
    m->drift_sum += hypot(m->last[f][0] - m->touchdown[f][0], m->last[f][1] - m->touchdown[f][1]);
    m->stances++;
}

static void measure_foot(Measure *m, int f, const RobotFoot *foot, int rigid) {
    if (foot->force[2] > CONTACT_FORCE) {
        if (!m->in_stance[f]) {
            start_stance(m, f, foot->sole_center);
        }
        m->air_time[f] = m->apex[f] = 0;
        m->last[f][0] = foot->sole_center[0];
        m->last[f][1] = foot->sole_center[1];
        m->deepest[f] = fmax(m->deepest[f], rigid ? 0 : foot->result.depth_max);
        return;
    }
    m->air_time[f] += m->dt;
    m->apex[f] = fmax(m->apex[f], foot->sole_height);
    if (m->in_stance[f] && m->air_time[f] > CHATTER_TIME) {
        end_stance(m, f);
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
    if (m->time >= MEASURE_STEADY && (m->steady_end == 0 || m->time < m->steady_end)) {
        if (m->steady_time == 0) {
            m->start_x = qpos[0];
            m->start_y = qpos[1];
        }
        m->steady_time += m->dt;
        m->end_x = qpos[0];
        m->end_y = qpos[1];
        m->work += power_abs * m->dt;
        double height = qpos[2] - mild_terrain_height_at(&env->terrain, qpos[0], qpos[1]);
        m->base_low = fmin(m->base_low, height);
        m->base_high = fmax(m->base_high, height);
    }
    for (int f = 0; f < ROBOT_FEET; f++) {
        measure_foot(m, f, robot_sim_foot(sim, f), env->variation.rigid);
    }
}

void measure_finish(Measure *m) {
    int lifted = m->stances > 0;
    for (int f = 0; f < ROBOT_FEET && !lifted; f++) {
        if (m->in_stance[f]) {
            end_stance(m, f);
        }
    }
}
