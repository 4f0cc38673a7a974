#include <math.h>

#include "env/task/task.h"

#define TWO_PI 6.283185307179586

TASK_FN int task_is_standing(const TaskDef *def, const TaskReal command[3]) {
    const double below = def->standing_below;
    return fabs(command[0]) < below && fabs(command[1]) < below && fabs(command[2]) < below;
}

/* T = gait_period (1 + gait_slowing max(0, 1 - v / gait_slow_below)),
 * v = |v_x| + 3 |v_y| + 1 m |w_z|
 *
 * A slow walk at the period of a fast one takes many short steps, each of which pays for a lifted
 * leg and, on soft ground, for an imprint: with 1.0 s in the place of 0.8 s, 0.3 m/s in loose sand
 * costs a sixth less. Steps to the side and turns weigh more, because they reach the end of their
 * range at a lower speed. */
TASK_FN double task_gait_period(const TaskDef *def, const TaskReal command[3]) {
    const double forward = command[0], left = command[1], turning = command[2];
    const double v = fabs(forward) + 3 * fabs(left) + fabs(turning);
    const double slow = 1 - v / def->gait_slow_below;
    return def->gait_period * (1 + def->gait_slowing * (slow > 0 ? slow : 0));
}

/* [-] Progress of the foot's swing, the half of the period before its stance; -1 in stance. */
MILD_HD_FN double swing_progress(const Robot *robot, double phase, int foot) {
    double offset = robot_gait_offset(robot, foot);
    double p = phase - (offset < 0.5 ? offset + 0.5 : offset - 0.5);
    p += p < 0 ? 1 : 0;
    return p >= 0.5 ? -1 : 2 * p;
}

/* The foot's clock: positive in stance, negative in swing. */
MILD_HD_FN double wave(const Robot *robot, double phase, int foot) {
    double offset = robot_gait_offset(robot, foot);
    return offset < 0.5 ? task_sin(TWO_PI * (phase - offset))
                        : -task_sin(TWO_PI * (phase - (offset - 0.5)));
}

TASK_FN int task_gait_stance(const Robot *robot, double phase, int standing, int foot) {
    return standing || swing_progress(robot, phase, foot) < 0;
}

TASK_FN int task_gait_either(const TaskDef *def, const Robot *robot, double phase, int standing,
                             int foot) {
    return !standing && fabs(wave(robot, phase, foot)) < def->double_support;
}

/* h_des = apex sin(pi s), with s the progress of the swing, so that the foot leaves and meets h0 on
 * time. */
TASK_FN double task_gait_height(const TaskDef *def, const Robot *robot, double phase, int standing,
                                int foot) {
    double s = swing_progress(robot, phase, foot);
    return standing || s < 0 ? 0 : def->swing_apex * task_sin(0.5 * TWO_PI * s);
}

/* The vendor's reference motion: the swing leg bends by A |sin| times `swing` of robot.ini. For
 * SA01 that is (-1, 2, -1) in hip pitch, knee and ankle pitch. */
TASK_FN double task_gait_reference(const TaskDef *def, const Robot *robot, double phase,
                                   int standing, int i) {
    int foot = robot_joint_foot(robot)[i];
    double now = foot < 0 || standing ? 0 : wave(robot, phase, foot);
    double bend = -now < def->double_support ? 0 : def->reward.reference_amplitude * -now;
    return robot_default_pose(robot)[i] + robot_swing(robot)[i] * bend;
}
