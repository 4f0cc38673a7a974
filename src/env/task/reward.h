/* Every reward of docs/task.md section 8, each its own short function, in one table with its
 * weight. Joints are those that the policy acts on: what the driven ones do is not its doing. */
#ifndef TASK_REWARD_H
#define TASK_REWARD_H

#include <math.h>

#include "env/task/gait.h"

/* Scales a sum over feet to two feet. */
MILD_HD_FN Real reward_per_pair(const TaskMotion *m, Real sum) {
    return sum * (2 / REAL(m->env->shape.feet));
}

/* The paper's exp(-k e^2) gives a signal even at large errors, but is flat near 0: being 0.05 m/s
 * too slow costs only 1 %. exp(-|e|/width) keeps its slope down to zero error. Both use the
 * velocity smoothed over half a gait period, because the sway within a step is not an error and
 * would hide one. */
MILD_HD_FN Real reward_tracking(const TaskMotion *m, Real error) {
    const RewardDef *def = &m->def->reward;
    const Real narrow = REAL(def->tracking_narrow);
    return (1 - narrow) * task_exp(-def->tracking_sharpness * task_square(error)) +
           narrow * task_exp(-fabs(error) / def->tracking_width);
}

/* Forward and sideways errors count separately. In the norm of both, a little sway would hide a
 * forward error. */
MILD_HD_FN Real reward_linear_velocity(const TaskMotion *m) {
    const Real *v = m->env->smooth_velocity, *command = m->env->command;
    return reward_tracking(m, v[0] - command[0]) * reward_tracking(m, v[1] - command[1]);
}

MILD_HD_FN Real reward_yaw_rate(const TaskMotion *m) {
    return reward_tracking(m, m->env->smooth_velocity[2] - m->env->command[2]);
}

/* [m] Mean depth of the feet that the clock wants in stance, at least 0. */
MILD_HD_FN Real reward_stance_depth(const TaskMotion *m) {
    Real sum = 0;
    int feet = 0;
    for (int f = 0; f < m->env->shape.feet; f++) {
        sum -= m->wanted[f].stance ? m->foot_height[f] : 0;
        feet += m->wanted[f].stance;
    }
    return sum > 0 ? sum / REAL(feet) : 0;
}

/* The paper prints a positive weight on an error (TASK_CLEARANCE_ERROR), which pays a foot for a
 * wrong height. The lift gives nothing to a foot that stays down (exp(-k error) would give it a
 * third of a perfect swing) and has a slope from the first millimetre. Lifting too high costs half
 * as much per metre as lifting gains. The scale is such that following h_des = apex sin(pi s) gives
 * 1 on average over the swing. From a deep print a foot lifts far before it meets the surface:
 * TASK_CLEARANCE_RISE counts from the depth of the standing feet. */
MILD_HD_FN Real reward_feet_clearance(const TaskMotion *m) {
    const int form = m->def->reward.clearance_form;
    const Real depth = form == TASK_CLEARANCE_RISE ? reward_stance_depth(m) : 0;
    Real sum = 0;
    for (int f = 0; f < m->env->shape.feet; f++) {
        Real h = m->foot_height[f], wanted = m->wanted[f].height;
        if (!m->wanted[f].stance && form == TASK_CLEARANCE_ERROR) {
            sum += REAL(fabs(wanted - h));
        } else if (!m->wanted[f].stance) {
            sum += REAL(1.5707963) *
                   (task_clamp(h + depth, 0, wanted + depth) -
                    REAL(0.5) * task_clamp(h - wanted, 0, 0.3)) /
                   (REAL(m->def->swing_apex) + depth);
        }
    }
    return reward_per_pair(m, sum);
}

/* The paper's sum over two feet has its -0.3 once: both match 2.3, one 1, none -0.3. The mean has a
 * range that does not depend on the number of feet. */
MILD_HD_FN Real reward_gait(const TaskMotion *m) {
    const int sums = m->def->reward.gait_form == TASK_GAIT_SUM;
    Real sum = 0;
    for (int f = 0; f < m->env->shape.feet; f++) {
        const int matches = m->wanted[f].either || m->contact[f] == m->wanted[f].stance;
        sum += matches ? 1 : sums ? 0 : REAL(-0.3);
    }
    return sums ? REAL(1.3) * reward_per_pair(m, sum) - REAL(0.3) : sum / REAL(m->env->shape.feet);
}

MILD_HD_FN Real reward_slip(const TaskMotion *m) {
    Real sum = 0;
    for (int f = 0; f < m->env->shape.feet; f++) {
        sum += m->contact[f] ? m->foot_speed[f] : 0;
    }
    return reward_per_pair(m, sum);
}

MILD_HD_FN Real reward_base_acceleration(const TaskMotion *m) {
    return task_exp(-3 * m->twist_change);
}

MILD_HD_FN Real reward_action_smoothness(const TaskMotion *m) {
    Real sum = 0;
    for (int i = tile_lane(); i < m->env->shape.actions; i += TILE) {
        Real a = m->env->action[0][i], a1 = m->env->action[1][i], a2 = m->env->action[2][i];
        sum += task_square(a - a1) + task_square(a - 2 * a1 + a2);
    }
    return tile_sum(sum);
}

MILD_HD_FN Real reward_reference_motion(const TaskMotion *m) {
    Real sum = 0;
    for (int i = tile_lane(); i < m->env->shape.actions; i += TILE) {
        const int foot = m->robot->joint_foot[i];
        const double bend = foot < 0 ? 0 : m->wanted[foot].bend;
        sum += task_square(m->q[i] - task_gait_joint(m->def, m->robot, bend, i));
    }
    Real d = task_sqrt(tile_sum(sum));
    return task_exp(-2 * d) - REAL(0.2) * task_clamp(d, 0, 0.5);
}

/* The vendor's exp(-100 x) alone is flat beyond a fifth of a radian, and so gives no signal
 * there. */
MILD_HD_FN Real reward_default_pose(const TaskMotion *m) {
    const double *pose = m->robot->default_pose, *still = m->robot->still;
    Real away = 0, all = 0;
    for (int f = -1; f < m->env->shape.feet; f++) { /* -1: the trunk's joints */
        Real leg = 0;
        for (int i = tile_lane(); i < m->env->shape.actions; i += TILE) {
            int same = m->robot->joint_foot[i] == f;
            leg += same ? task_square(still[i] * (m->q[i] - pose[i])) : 0;
        }
        away += task_sqrt(tile_sum(leg));
    }
    for (int i = tile_lane(); i < m->env->shape.actions; i += TILE) {
        all += task_square(m->q[i] - pose[i]);
    }
    return REAL(0.5) *
               (task_exp(-100 * task_clamp(away - REAL(0.1), 0, 50)) + task_exp(-3 * away)) -
           REAL(0.01) * task_sqrt(tile_sum(all));
}

MILD_HD_FN Real reward_base_height(const TaskMotion *m) {
    return task_exp(-100 * fabs(m->base_height - task_nominal_height(m->def, m->robot)));
}

MILD_HD_FN Real reward_within(Real distance, const double wanted[2], const double own[2]) {
    const double *limits = wanted[1] > 0 ? wanted : own;
    Real below = task_clamp(limits[0] - distance, 0, 0.5),
         above = task_clamp(distance - limits[1], 0, 0.5);
    return REAL(0.5) * (task_exp(-100 * below) + task_exp(-100 * above));
}

MILD_HD_FN Real reward_feet_distance(const TaskMotion *m) {
    return reward_within(m->foot_distance, m->def->reward.feet_range, m->robot->feet_range);
}

MILD_HD_FN Real reward_knee_distance(const TaskMotion *m) {
    return reward_within(m->knee_distance, m->def->reward.knee_range, m->robot->knee_range);
}

MILD_HD_FN Real reward_orientation(const TaskMotion *m) {
    Real tilt = task_sqrt(task_square(m->gravity[0]) + task_square(m->gravity[1]));
    return REAL(0.5) *
           (task_exp(-10 * (fabs(m->gravity[0]) + fabs(m->gravity[1]))) + task_exp(-4 * tilt));
}

/* Paid once, at touchdown. It is divided by the period, because rewards are rates that are
 * multiplied by the period. The vendor's version lacks this, so only a hundredth of it remains,
 * which a learner does not notice. */
MILD_HD_FN Real reward_air_time(const TaskMotion *m) {
    return m->standing ? 0 : reward_per_pair(m, m->landed_air_time) / REAL(TASK_PERIOD);
}

MILD_HD_FN Real reward_base_motion(const TaskMotion *m) {
    return REAL(0.5) *
           (task_exp(-10 * task_square(m->velocity[2])) +
            task_exp(-5 * task_sqrt(task_square(m->omega[0]) + task_square(m->omega[1]))));
}

/* A foot that stands for half as long bears twice as much. */
MILD_HD_FN Real reward_contact_force(const TaskMotion *m) {
    const double share = task_gait_share(m->def, m->env->command);
    Real sum = 0, hard = m->robot->foot_force * 0.5 / share;
    for (int f = 0; f < m->env->shape.feet; f++) {
        sum += task_clamp(m->foot_force[f] - hard, 0, REAL(0.8) * hard);
    }
    return reward_per_pair(m, sum);
}

MILD_HD_FN Real reward_torque(const TaskMotion *m) {
    Real sum = 0;
    for (int i = tile_lane(); i < m->env->shape.actions; i += TILE) {
        sum += task_square(m->torque[i]);
    }
    return tile_sum(sum);
}

MILD_HD_FN Real reward_joint_speed(const TaskMotion *m) {
    Real sum = 0;
    for (int i = tile_lane(); i < m->env->shape.actions; i += TILE) {
        sum += task_square(m->qd[i]);
    }
    return tile_sum(sum);
}

MILD_HD_FN Real reward_joint_acceleration(const TaskMotion *m) {
    Real sum = 0;
    for (int i = tile_lane(); i < m->env->shape.actions; i += TILE) {
        sum += task_square((m->qd[i] - m->qd_before[i]) / REAL(TASK_PERIOD));
    }
    return tile_sum(sum);
}

/* As the cost of transport counts it. */
MILD_HD_FN Real reward_power(const TaskMotion *m) {
    Real sum = 0;
    for (int i = tile_lane(); i < m->env->shape.actions; i += TILE) {
        sum += REAL(fabs(m->torque[i] * m->qd[i]));
    }
    return tile_sum(sum);
}

MILD_HD_FN Real reward_upright(const TaskMotion *m) {
    return task_clamp(REAL(0.5) * (1 - m->gravity[2]), 0, 1);
}

/* Has a slope wherever the base is, unlike base_height. */
MILD_HD_FN Real reward_rise(const TaskMotion *m) {
    return task_clamp(m->base_height / REAL(task_nominal_height(m->def, m->robot)), 0, 1);
}

/* The base is to fly as free fall does. With the rise h of the command it leaves the ground at
 * w = sqrt(2 g h), and after a time t of its flight it has risen by w t - g t^2/2. The speed is a
 * factor: as a term of its own it is neglected, or bought with lower jumps. */
MILD_HD_FN Real reward_jump(const TaskMotion *m) {
    const Real *command = m->env->command;
    const double share = task_gait_share(m->def, command), phase = m->env->phase;
    if (task_jump_flight(command) == 0 || phase < share) {
        return 0;
    }
    const double t = (phase - share) * task_gait_period(m->def, command);
    const double w = task_sqrt(2 * GAIT_GRAVITY * command[TASK_RISE]);
    const Real e = m->rise - REAL(w * t - 0.5 * GAIT_GRAVITY * t * t);
    return task_exp(-fabs(e) / REAL(0.05)) *
           reward_tracking(m, m->env->smooth_velocity[TASK_FORWARD] - command[TASK_FORWARD]);
}

/* [-] By what all terms with a positive weight but upright are multiplied, so that a robot that
 * lies still is not paid for standing still. */
MILD_HD_FN Real reward_gate(const TaskMotion *m) {
    Real gate = 1;
    for (int i = 0; i < m->def->reward.gate; i++) {
        gate *= reward_upright(m);
    }
    return gate;
}

/* Penalises legs that are too close. */
MILD_HD_FN Real reward_collision(const TaskMotion *m) {
    int close =
        (m->foot_distance < m->robot->feet_least) + (m->knee_distance < m->robot->knee_least);
    return REAL(close);
}

/* Writes the weighted terms per second to `terms`. Returns their clipped sum times the period. */
MILD_HD_FN Real task_reward(const TaskMotion *motion, Real terms[TASK_REWARD_COUNT]) {
    const double *weight = motion->def->reward.weight;
    const Real gate = reward_gate(motion);
    Real sum = 0;
#define TASK_REWARD_TERM(name, weight_, help)                                                      \
    terms[REWARD_##name] =                                                                         \
        weight[REWARD_##name] == 0 ? 0 : REAL(weight[REWARD_##name]) * reward_##name(motion);      \
    if (weight[REWARD_##name] > 0 && REWARD_##name != REWARD_upright) {                            \
        terms[REWARD_##name] *= gate;                                                              \
    }                                                                                              \
    sum += terms[REWARD_##name];
    TASK_REWARD_LIST(TASK_REWARD_TERM)
#undef TASK_REWARD_TERM
    if (motion->def->reward.clip_sum && sum < 0) {
        sum = 0;
    }
    return sum * REAL(TASK_PERIOD);
}

#endif
