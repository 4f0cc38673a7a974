/* Soft ground by another program: a child process for each trial, which is asked in every physics
 * step. Both sides speak doubles of this machine over standard input and output. A question:
 *
 *     feet n, time of the step's end [s], dt [s], trial
 *     n times: ankle 3 [m], rotation 9 (foot to world, row major), twist at the ankle 6
 *     twists after a step without ground, V_free [6 n]
 *     inverse inertia A [6 n][6 n], so that V = V_free + dt A W with the wrenches W
 *
 * An answer, n times: force 3 [N] and torque about the ankle 3 [N m] on the foot, means over the
 * step, world axes; largest and mean depth [m], 0 without contact. The end of the input ends the
 * program. */
#ifndef MILD_OTHER_GROUND_H
#define MILD_OTHER_GROUND_H

#include "robot/robot.h"

typedef struct OtherGround OtherGround;

/* command: of a shell. NULL, with one line in *error, when a child cannot be started. */
OtherGround *other_ground_start(const char *command, const Robot *robot, int trials,
                                MildError *error);
const RobotGround *other_ground_of(const OtherGround *other); /* [trials] */
/* Waits for the children to end, and frees. Returns `status`, or the failure of a child that ended
 * before its time or not well. */
MildStatus other_ground_stop(OtherGround *other, MildStatus status, MildError *error);

#endif
