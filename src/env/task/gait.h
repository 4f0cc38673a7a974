/* Gait clock (docs/task.md section 7): a foot is in stance during the half of the period that
 * starts at its offset. */
#ifndef TASK_GAIT_H
#define TASK_GAIT_H

#include <math.h>

#include "env/task/state.h"

/* Bool: the command is to stand. */
MILD_HD_FN int task_is_standing(const TaskDef *def, const Real command[3]) {
    const double below = def->standing_below;
    return fabs(command[0]) < below && fabs(command[1]) < below && fabs(command[2]) < below;
}

/* [s] Period of the clock under a command,
 *
 * T = gait_period (1 + gait_slowing max(0, 1 - v / gait_slow_below)),
 * v = |v_x| + 3 |v_y| + 1 m |w_z|
 *
 * A slow walk at the period of a fast one takes many short steps, each of which pays for a lifted
 * leg and, on soft ground, for an imprint: with 1.0 s in the place of 0.8 s, 0.3 m/s in loose sand
 * costs a sixth less. Steps to the side and turns weigh more, because they reach the end of their
 * range at a lower speed. */
MILD_HD_FN double task_gait_period(const TaskDef *def, const Real command[3]) {
    const double forward = command[0], left = command[1], turning = command[2];
    const double v = fabs(forward) + 3 * fabs(left) + fabs(turning);
    const double slow = 1 - v / def->gait_slow_below;
    return def->gait_period * (1 + def->gait_slowing * (slow > 0 ? slow : 0));
}

/* [-] Progress of the foot's swing, the half of the period before its stance; -1 in stance. */
MILD_HD_FN double gait_swing(const RobotTable *robot, double phase, int foot) {
    double offset = robot->gait_offset[foot];
    double p = phase - (offset < 0.5 ? offset + 0.5 : offset - 0.5);
    p += p < 0 ? 1 : 0;
    return p >= 0.5 ? -1 : 2 * p;
}

/* The foot's clock: positive in stance, negative in swing. */
MILD_HD_FN double gait_wave(const RobotTable *robot, double phase, int foot) {
    double offset = robot->gait_offset[foot];
    return offset < 0.5 ? task_sin(TASK_TWO_PI * (phase - offset))
                        : -task_sin(TASK_TWO_PI * (phase - (offset - 0.5)));
}

/* Bool: the clock wants the foot in stance. */
MILD_HD_FN int task_gait_stance(const RobotTable *robot, double phase, int standing, int foot) {
    return standing || gait_swing(robot, phase, foot) < 0;
}

/* Bool: near touchdown and lift-off, where stance and swing are both right. */
MILD_HD_FN int task_gait_either(const TaskDef *def, const RobotTable *robot, double phase,
                                int standing, int foot) {
    return !standing && fabs(gait_wave(robot, phase, foot)) < def->double_support;
}

/* [m] h_des = apex sin(pi s), with s the progress of the swing, so that the foot leaves and meets
 * h0 on time. */
MILD_HD_FN double task_gait_height(const TaskDef *def, const RobotTable *robot, double phase,
                                   int standing, int foot) {
    double s = gait_swing(robot, phase, foot);
    return standing || s < 0 ? 0 : def->swing_apex * task_sin(0.5 * TASK_TWO_PI * s);
}

/* [rad] Angle of joint i in the vendor's reference motion: the swing leg bends by
 * A |sin| times `swing` of robot.ini. For SA01 that is (-1, 2, -1) in hip pitch, knee and ankle
 * pitch. */
MILD_HD_FN double task_gait_reference(const TaskDef *def, const RobotTable *robot, double phase,
                                      int standing, int i) {
    int foot = robot->joint_foot[i];
    double now = foot < 0 || standing ? 0 : gait_wave(robot, phase, foot);
    double bend = -now < def->double_support ? 0 : def->reward.reference_amplitude * -now;
    return robot->default_pose[i] + robot->swing[i] * bend;
}

#endif
