/* How a camera follows what it looks at: smoothly, by the time that passed and not by the number of
 * frames, and without staying behind something that moves evenly. */
#ifndef VIEW_FOLLOW_H
#define VIEW_FOLLOW_H

typedef struct {
    double once[3], twice[3]; /* [m] the target filtered once and twice */
    double target[3];         /* [m] at the last step */
} Follow;

/* The camera jumps to the target. */
void follow_jump(Follow *follow, const double target[3]);
/* elapsed: [s] since the last step; lag: [s] time constant. */
void follow_step(Follow *follow, const double target[3], double elapsed, double lag);
/* [m] Where the camera looks. */
void follow_position(const Follow *follow, double position[3]);

#endif
