/* Holds the commanded speed by the velocity that the policy estimates, and the turn by the gyro. A
 * policy follows a command up to a factor, which depends on the ground, the robot and its
 * latencies. With v the mean of the measured velocity over a cycle of the gait clock, and a command
 * that the policy sees of the wanted one times 1 + r, forward, to the left and turning,
 *
 *     m += max(gain, 1/n) (v/command - m),    1/(1 + r) = known + n^2/(n^2 + 1) (m - known)
 *
 * over the n cycles since the wanted command changed; known = 1 at the start, and what r was where
 * it changed; |r| <= 0.2, of a turn 0.4. A robot that speeds up is slower than it will be: two
 * cycles after a change do not count, nor does any in a second for each m/s of it.
 * docs/controllers.md has what it is worth. */
#ifndef CONTROL_SPEED_HOLD_H
#define CONTROL_SPEED_HOLD_H

/* Constant. */
typedef struct {
    double gain;  /* [-] TaskDef.speed_hold; 0: off */
    double scale; /* [-] of the velocity among the estimates */
    double most;  /* [m/s] TaskDef.speed_hold_most; 0: no bound */
    int clock;    /* place of sin and cos of the gait's phase in a frame */
} SpeedHoldDef;

/* Those of a command that change apart: its first two numbers, and its third. */
enum { SPEED_HOLD_LINEAR, SPEED_HOLD_TURN, SPEED_HOLD_PARTS };

/* Of one robot; zeros before the first frame. */
typedef struct {
    double ratio[3];                /* [-] r, forward, to the left, turning */
    int cycles[SPEED_HOLD_PARTS];   /* n */
    double before[3];               /* [-] 1/(1 + r) - 1 where the wanted command changed */
    double mean[3];                 /* [-] m */
    int settling[SPEED_HOLD_PARTS]; /* cycles that a start or another command makes useless */
    double late;                    /* [s] until it has the speed of the command */
    double wanted[3];               /* [m/s, m/s, rad/s] */
    /* the cycle since the clock's last turn */
    double sine;               /* of its phase in the last frame */
    int begun, turning, steps; /* bool, bool, policy steps */
    double way[3];             /* [m/s, m/s, rad/s] sum of what is measured */
} SpeedHold;

/* After each policy step. frame: [observation] the newest one, as the policy sees it. estimates: of
 * controller_estimates. Changes command from what is wanted to what to command. Allocates nothing;
 * may run at the same time for different SpeedHold. */
void speed_hold(SpeedHold *hold, const SpeedHoldDef *def, const float *frame,
                const float *estimates, double command[3]);

#endif
