/* Holds the commanded speed by leg odometry. A policy follows a command up to a factor of a few
 * percent, which depends on the ground, the robot and its latencies. Legs measure it: when the
 * stance passes from some feet to others, the base has come as far as these are apart. Over a gait
 * cycle
 *
 *     v(c) = (sum over its passings of p'(c) - p(c)) / its duration
 *
 * with p(k) and p'(k) the means of the old and the new stance feet's sole centres in the base's
 * heading frame, from the joint angles of three frames around k frames after the clock's passing.
 * Above a Froude number of 0.08 both feet may be in the air then: three frames are left out, of the
 * way, p'(c + 2) - p(c - 1), and of its time. Which c? A foot in the air moves forward, so the base
 * goes slower against it than against one on the ground: v(c) is largest where the feet really
 * change. c is where the mean of v over past cycles, along the command, is largest.
 *
 * What is down follows the turning rate, and the noisy gravity with a time constant of 0.2 s: the
 * noise tilts p and p' nearly alike, and leaves p' - p as it is.
 *
 * The command that the policy sees is the wanted one times 1 + r. Steps telescope, so the error of
 * the mean over n cycles falls as 1/n, and its weight beside what was known before as n^2:
 *
 *     m += max(gain, 1/n) (v/command - m),    1/(1 + r) = known + n^2/(n^2 + 16) (m - known)
 *
 * with known = 1 at the start, and what r was where the wanted command changed; |r| <= 0.2.
 *
 * docs/controllers.md has what it measures and what it is worth. */
#ifndef CONTROL_SPEED_HOLD_H
#define CONTROL_SPEED_HOLD_H

#include "robot/robot.h"

enum { SPEED_HOLD_LINKS_MAX = 16, SPEED_HOLD_EARLY = 4, SPEED_HOLD_LATE = 8 };
/* Frames at a passing that are left out, before c and after it. */
enum { SPEED_HOLD_BEFORE = 1, SPEED_HOLD_AFTER = 2 };
/* Values of c, and the frames that are kept for them. */
enum {
    SPEED_HOLD_SHIFTS = SPEED_HOLD_EARLY + SPEED_HOLD_LATE - 1 - SPEED_HOLD_AFTER,
    SPEED_HOLD_FRAMES = SPEED_HOLD_EARLY + SPEED_HOLD_LATE + SPEED_HOLD_BEFORE + 1
};

/* From a body to its parent: about a hinge, then to its place there. */
typedef struct {
    int joint; /* of robot.ini, or -1: welded, or a joint that is not in the frame */
    double axis[3], anchor[3], zero;
    double place[3], turn[9];
} SpeedHoldLink;

/* A robot's legs, constant. */
typedef struct {
    double gain;   /* [-] TaskDef.speed_hold; 0: off, and nothing else is there */
    double flying; /* [m/s] speed above which both feet may be in the air */
    int joints, feet;
    double pose[ROBOT_JOINTS_MAX];         /* [rad] what a frame's angles are from */
    double gait_offset[ROBOT_FEET_MAX];    /* of RobotTable */
    double sole_center[ROBOT_FEET_MAX][3]; /* [m] in the foot */
    int links[ROBOT_FEET_MAX];             /* from the foot up to the base */
    SpeedHoldLink link[ROBOT_FEET_MAX][SPEED_HOLD_LINKS_MAX];
} SpeedHoldLegs;

/* Of one robot; zeros before the first frame. */
typedef struct {
    double ratio[2];                 /* [-] r, forward and to the left */
    double speed[2];                 /* [m/s] v of the last cycle */
    int shift;                       /* of this speed: c + SPEED_HOLD_EARLY - 1 */
    int cycles;                      /* that r has learned from since it settled */
    double before[2];                /* [-] 1/(1 + r) - 1 then */
    double mean[2];                  /* [-] of the cycles' factors since then */
    int settling;                    /* cycles that a start or another command makes useless */
    double wanted[2];                /* [m/s] the command since it settled */
    double along[SPEED_HOLD_SHIFTS]; /* [m/s] mean of v(c) along the command */
    /* the last frames, newest first */
    int frames;
    double down[3], rate[3];                           /* [-], [rad/s] of the newest, in the base */
    double foot[SPEED_HOLD_FRAMES][ROBOT_FEET_MAX][2]; /* [m] in the heading frame */
    unsigned stance[SPEED_HOLD_FRAMES];                /* bits of the feet */
    /* the cycle since foot 0's last start of a stance */
    int begun, turning, duration;     /* bool, bool, frames without those that are left out */
    double way[SPEED_HOLD_SHIFTS][2]; /* [m] */
} SpeedHold;

/* gain: of a task. Off for round feet, which roll, so that their steps are not their way. Fails for
 * a leg of more than SPEED_HOLD_LINKS_MAX bodies. */
MildStatus speed_hold_legs(const Robot *robot, double gain, SpeedHoldLegs *legs, MildError *error);
/* [m] The feet's sole centres in the base's frame at joint angles q [joints]. */
void speed_hold_feet(const SpeedHoldLegs *legs, const double *q, double (*foot)[3]);
/* After each policy step. frame: [observation] the newest one, as the policy sees it. Changes the
 * forward and left parts of command from what is wanted to what to command. Allocates nothing; may
 * run at the same time for different SpeedHold. */
void speed_hold(SpeedHold *hold, const SpeedHoldLegs *legs, const float *frame, double command[3]);

#endif
