/* Every reward of docs/task.md section 8, each its own short function, in one table with its
 * weight. */
#include <math.h>
#include <string.h>

#include "env/task/task.h"

MILD_HD_FN TaskReal square(TaskReal x) {
    return x * x;
}

MILD_HD_FN TaskReal clamp(TaskReal x, TaskReal low, TaskReal high) {
    return x < low ? low : x > high ? high : x;
}

/* Scales a sum over feet to two feet. */
MILD_HD_FN TaskReal per_pair(const TaskMotion *m, TaskReal sum) {
    return sum * (2 / TASK_REAL(m->env->shape.feet));
}

/* The paper's exp(-k e^2) gives a signal even at large errors, but is flat near 0: being 0.05 m/s
 * too slow costs only 1 %. exp(-|e|/width) keeps its slope down to zero error. Both use the
 * velocity smoothed over half a gait period, because the sway within a step is not an error and
 * would hide one. */
MILD_HD_FN TaskReal tracking(const TaskMotion *m, TaskReal error) {
    const RewardDef *def = &m->def->reward;
    const TaskReal narrow = TASK_REAL(def->tracking_narrow);
    return (1 - narrow) * task_exp(-def->tracking_sharpness * square(error)) +
           narrow * task_exp(-fabs(error) / def->tracking_width);
}

/* Forward and sideways errors count separately. In the norm of both, a little sway would hide a
 * forward error. */
MILD_HD_FN TaskReal reward_linear_velocity(const TaskMotion *m) {
    const TaskReal *v = m->env->smooth_velocity, *command = m->env->command;
    return tracking(m, v[0] - command[0]) * tracking(m, v[1] - command[1]);
}

MILD_HD_FN TaskReal reward_yaw_rate(const TaskMotion *m) {
    return tracking(m, m->env->smooth_velocity[2] - m->env->command[2]);
}

/* [m] Mean depth of the feet that the clock wants in stance, at least 0. */
MILD_HD_FN TaskReal stance_depth(const TaskMotion *m) {
    TaskReal sum = 0;
    int feet = 0;
    for (int f = 0; f < m->env->shape.feet; f++) {
        sum -= m->stance[f] ? m->foot_height[f] : 0;
        feet += m->stance[f];
    }
    return sum > 0 ? sum / TASK_REAL(feet) : 0;
}

/* The paper prints a positive weight on an error (TASK_CLEARANCE_ERROR), which pays a foot for a
 * wrong height. The lift gives nothing to a foot that stays down (exp(-k error) would give it a
 * third of a perfect swing) and has a slope from the first millimetre. Lifting too high costs half
 * as much per metre as lifting gains. The scale is such that following h_des = apex sin(pi s) gives
 * 1 on average over the swing. From a deep imprint a foot lifts far before it meets the surface:
 * TASK_CLEARANCE_RISE counts from the depth of the standing feet. */
MILD_HD_FN TaskReal reward_feet_clearance(const TaskMotion *m) {
    const int form = m->def->reward.clearance_form;
    const TaskReal depth = form == TASK_CLEARANCE_RISE ? stance_depth(m) : 0;
    TaskReal sum = 0;
    for (int f = 0; f < m->env->shape.feet; f++) {
        TaskReal h = m->foot_height[f], wanted = m->wanted_height[f];
        if (!m->stance[f] && form == TASK_CLEARANCE_ERROR) {
            sum += TASK_REAL(fabs(wanted - h));
        } else if (!m->stance[f]) {
            sum +=
                TASK_REAL(1.5707963) *
                (clamp(h + depth, 0, wanted + depth) - TASK_REAL(0.5) * clamp(h - wanted, 0, 0.3)) /
                (TASK_REAL(m->def->swing_apex) + depth);
        }
    }
    return per_pair(m, sum);
}

/* The paper's sum over two feet has its -0.3 once: both match 2.3, one 1, none -0.3. The mean has a
 * range that does not depend on the number of feet. */
MILD_HD_FN TaskReal reward_gait(const TaskMotion *m) {
    const int sums = m->def->reward.gait_form == TASK_GAIT_SUM;
    TaskReal sum = 0;
    for (int f = 0; f < m->env->shape.feet; f++) {
        const int matches = m->either[f] || m->contact[f] == m->stance[f];
        sum += matches ? 1 : sums ? 0 : TASK_REAL(-0.3);
    }
    return sums ? TASK_REAL(1.3) * per_pair(m, sum) - TASK_REAL(0.3)
                : sum / TASK_REAL(m->env->shape.feet);
}

MILD_HD_FN TaskReal reward_slip(const TaskMotion *m) {
    TaskReal sum = 0;
    for (int f = 0; f < m->env->shape.feet; f++) {
        sum += m->contact[f] ? m->foot_speed[f] : 0;
    }
    return per_pair(m, sum);
}

MILD_HD_FN TaskReal reward_base_acceleration(const TaskMotion *m) {
    return task_exp(-3 * m->twist_change);
}

MILD_HD_FN TaskReal reward_action_smoothness(const TaskMotion *m) {
    TaskReal sum = 0;
    for (int i = task_lane(); i < m->env->shape.actions; i += TASK_LANES) {
        TaskReal a = m->env->action[0][i], a1 = m->env->action[1][i], a2 = m->env->action[2][i];
        sum += square(a - a1) + square(a - 2 * a1 + a2);
    }
    return task_lanes_sum(sum);
}

MILD_HD_FN TaskReal reward_reference_motion(const TaskMotion *m) {
    TaskReal sum = 0;
    for (int i = task_lane(); i < m->env->shape.joints; i += TASK_LANES) {
        sum +=
            square(m->q[i] - task_gait_reference(m->def, m->robot, m->env->phase, m->standing, i));
    }
    TaskReal d = task_sqrt(task_lanes_sum(sum));
    return task_exp(-2 * d) - TASK_REAL(0.2) * clamp(d, 0, 0.5);
}

/* The vendor's exp(-100 x) alone is flat beyond a fifth of a radian, and so gives no signal
 * there. */
MILD_HD_FN TaskReal reward_default_pose(const TaskMotion *m) {
    const double *pose = robot_default_pose(m->robot), *still = robot_still(m->robot);
    TaskReal away = 0, all = 0;
    for (int f = -1; f < m->env->shape.feet; f++) { /* -1: the trunk's joints */
        TaskReal leg = 0;
        for (int i = task_lane(); i < m->env->shape.joints; i += TASK_LANES) {
            int same = robot_joint_foot(m->robot)[i] == f;
            leg += same ? square(still[i] * (m->q[i] - pose[i])) : 0;
        }
        away += task_sqrt(task_lanes_sum(leg));
    }
    for (int i = task_lane(); i < m->env->shape.joints; i += TASK_LANES) {
        all += square(m->q[i] - pose[i]);
    }
    return TASK_REAL(0.5) *
               (task_exp(-100 * clamp(away - TASK_REAL(0.1), 0, 50)) + task_exp(-3 * away)) -
           TASK_REAL(0.01) * task_sqrt(task_lanes_sum(all));
}

MILD_HD_FN TaskReal reward_base_height(const TaskMotion *m) {
    return task_exp(-100 * fabs(m->base_height - task_nominal_height(m->def, m->robot)));
}

MILD_HD_FN TaskReal within(TaskReal distance, const double wanted[2], const double own[2]) {
    const double *limits = wanted[1] > 0 ? wanted : own;
    TaskReal below = clamp(limits[0] - distance, 0, 0.5),
             above = clamp(distance - limits[1], 0, 0.5);
    return TASK_REAL(0.5) * (task_exp(-100 * below) + task_exp(-100 * above));
}

MILD_HD_FN TaskReal reward_feet_distance(const TaskMotion *m) {
    return within(m->foot_distance, m->def->reward.feet_range, robot_feet_range(m->robot));
}

MILD_HD_FN TaskReal reward_knee_distance(const TaskMotion *m) {
    return within(m->knee_distance, m->def->reward.knee_range, robot_knee_range(m->robot));
}

MILD_HD_FN TaskReal reward_orientation(const TaskMotion *m) {
    TaskReal tilt = task_sqrt(square(m->gravity[0]) + square(m->gravity[1]));
    return TASK_REAL(0.5) *
           (task_exp(-10 * (fabs(m->gravity[0]) + fabs(m->gravity[1]))) + task_exp(-4 * tilt));
}

/* Paid once, at touchdown. It is divided by the period, because rewards are rates that are
 * multiplied by the period. The vendor's version lacks this, so only a hundredth of it remains,
 * which a learner does not notice. */
MILD_HD_FN TaskReal reward_air_time(const TaskMotion *m) {
    return m->standing ? 0 : per_pair(m, m->landed_air_time) / TASK_REAL(TASK_PERIOD);
}

MILD_HD_FN TaskReal reward_base_motion(const TaskMotion *m) {
    return TASK_REAL(0.5) * (task_exp(-10 * square(m->velocity[2])) +
                             task_exp(-5 * task_sqrt(square(m->omega[0]) + square(m->omega[1]))));
}

MILD_HD_FN TaskReal reward_contact_force(const TaskMotion *m) {
    TaskReal sum = 0, hard = robot_foot_force(m->robot);
    for (int f = 0; f < m->env->shape.feet; f++) {
        sum += clamp(m->foot_force[f] - hard, 0, TASK_REAL(0.8) * hard);
    }
    return per_pair(m, sum);
}

MILD_HD_FN TaskReal reward_torque(const TaskMotion *m) {
    TaskReal sum = 0;
    for (int i = task_lane(); i < m->env->shape.joints; i += TASK_LANES) {
        sum += square(m->torque[i]);
    }
    return task_lanes_sum(sum);
}

MILD_HD_FN TaskReal reward_joint_speed(const TaskMotion *m) {
    TaskReal sum = 0;
    for (int i = task_lane(); i < m->env->shape.joints; i += TASK_LANES) {
        sum += square(m->qd[i]);
    }
    return task_lanes_sum(sum);
}

MILD_HD_FN TaskReal reward_joint_acceleration(const TaskMotion *m) {
    TaskReal sum = 0;
    for (int i = task_lane(); i < m->env->shape.joints; i += TASK_LANES) {
        sum += square((m->qd[i] - m->qd_before[i]) / TASK_REAL(TASK_PERIOD));
    }
    return task_lanes_sum(sum);
}

/* What the cost of transport counts. */
MILD_HD_FN TaskReal reward_power(const TaskMotion *m) {
    TaskReal sum = 0;
    for (int i = task_lane(); i < m->env->shape.joints; i += TASK_LANES) {
        sum += TASK_REAL(fabs(m->torque[i] * m->qd[i]));
    }
    return task_lanes_sum(sum);
}

/* Penalises legs that are too close, because the engine computes no contact between them. */
MILD_HD_FN TaskReal reward_collision(const TaskMotion *m) {
    int close = (m->foot_distance < robot_feet_least(m->robot)) +
                (m->knee_distance < robot_knee_least(m->robot));
    return TASK_REAL(close);
}

TASK_FN TaskReal task_reward(const TaskMotion *motion, TaskReal terms[TASK_REWARD_COUNT]) {
    const double *weight = motion->def->reward.weight;
    TaskReal sum = 0;
#define TASK_REWARD_TERM(name, weight_, help)                                                      \
    terms[REWARD_##name] =                                                                         \
        weight[REWARD_##name] == 0 ? 0 : TASK_REAL(weight[REWARD_##name]) * reward_##name(motion); \
    sum += terms[REWARD_##name];
    TASK_REWARD_LIST(TASK_REWARD_TERM)
    if (motion->def->reward.clip_sum && sum < 0) {
        sum = 0;
    }
    return sum * TASK_REAL(TASK_PERIOD);
}
