/* Gait clock (docs/task.md section 7): a foot is in stance during the share of the period that
 * starts at its offset. */
#ifndef TASK_GAIT_H
#define TASK_GAIT_H

#include <math.h>

#include "env/task/state.h"

#define GAIT_GRAVITY 9.81

/* Bool: the command is to stand. */
MILD_HD_FN int task_is_standing(const TaskDef *def, const Real command[TASK_COMMANDS]) {
    const double below = def->standing_below;
    return fabs(command[0]) < below && fabs(command[1]) < below && fabs(command[2]) < below &&
           command[TASK_RISE] <= 0;
}

/* [s] Free flight up by the command's rise and down again, 2 sqrt(2 rise/g); 0: no jump. */
MILD_HD_FN double task_jump_flight(const Real command[TASK_COMMANDS]) {
    const double rise = command[TASK_RISE];
    return rise > 0 ? 2 * task_sqrt(2 * rise / GAIT_GRAVITY) : 0;
}

/* [s] Period of the clock under a command,
 *
 * T = gait_period (1 + gait_slowing max(0, 1 - v / gait_slow_below)),
 * v = |v_x| + 3 |v_y| + 1 m |w_z|
 *
 * Slow steps are long, because each pays for a lifted leg and an imprint. Steps to the side and
 * turns weigh more, because they reach the end of their range at a lower speed. A jump takes
 * jump_stance and its flight. */
MILD_HD_FN double task_gait_period(const TaskDef *def, const Real command[TASK_COMMANDS]) {
    const double flight = task_jump_flight(command);
    if (flight > 0) {
        return def->jump_stance + flight;
    }
    const double forward = command[0], left = command[1], turning = command[2];
    const double v = fabs(forward) + 3 * fabs(left) + fabs(turning);
    const double slow = 1 - v / def->gait_slow_below;
    return def->gait_period * (1 + def->gait_slowing * (slow > 0 ? slow : 0));
}

/* [-] Share of the period that a foot stands. Below 1/2 the robot flies: feet half a period apart
 * are both in the air for 1 - 2 share of it. */
MILD_HD_FN double task_gait_share(const TaskDef *def, const Real command[TASK_COMMANDS]) {
    const double flight = task_jump_flight(command);
    if (flight > 0) {
        return def->jump_stance / (def->jump_stance + flight);
    }
    const double *share = def->stance_share, *speed = def->run_speed, v = fabs(command[0]);
    const double run = v < speed[1] ? (v - speed[0]) / (speed[1] - speed[0]) : 1;
    return share[1] - (run > 0 ? run : 0) * (share[1] - share[0]);
}

MILD_HD_FN TaskFoot task_gait_foot(const TaskDef *def, const RobotTable *robot, double phase,
                                   const Real command[TASK_COMMANDS], int foot) {
    const TaskFoot stands = {1, 0, 0, 0};
    const double offset = robot->gait_offset[foot], share = task_gait_share(def, command);
    const double since = phase - offset + (phase < offset);
    const int second = offset >= 0.5; /* bool: stands in the second half of a walk's period */
    if (task_is_standing(def, command)) {
        return stands;
    }
    /* The foot's own clock, on which stance and swing last half of the period each. */
    phase += since < share ? since * (0.5 / share - 1) : (1 - since) * (1 - 0.5 / (1 - share));
    const double cycle = phase - (offset - 0.5 * second);
    const Real wave = (second ? -1 : 1) * task_sin(TASK_TWO_PI * cycle);
    double lifted = cycle - 0.5 * !second;
    lifted -= floor(lifted);
    const int swings = lifted < 0.5;
    const TaskFoot moves = {!swings, fabs(wave) < def->double_support,
                            REAL(swings ? def->swing_apex * task_sin(TASK_TWO_PI * lifted) : 0),
                            -wave < def->double_support ? 0 : -wave};
    return moves;
}

/* [rad] Angle of joint i in the vendor's reference motion: the swing leg bends by
 * A |sin| times `swing` of robot.ini. For SA01 that is (-1, 2, -1) in hip pitch, knee and ankle
 * pitch. bend: of its foot, 0 of the trunk. */
MILD_HD_FN double task_gait_joint(const TaskDef *def, const RobotTable *robot, double bend, int i) {
    return robot->default_pose[i] + robot->swing[i] * (def->reward.reference_amplitude * bend);
}

MILD_HD_FN double task_gait_reference(const TaskDef *def, const RobotTable *robot, double phase,
                                      const Real command[TASK_COMMANDS], int i) {
    const int foot = robot->joint_foot[i];
    const double bend = foot < 0 ? 0 : task_gait_foot(def, robot, phase, command, foot).bend;
    return task_gait_joint(def, robot, bend, i);
}

#endif
