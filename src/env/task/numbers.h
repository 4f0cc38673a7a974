/* Numbers of the task's functions, which are the same code on the CPU and on a GPU: step.h, gait.h,
 * assist.h, observe.h, reward.h, randomize.h. They are compiled twice, as the ground's law is: for
 * robots that MuJoCo steps (task.h) with Real = double, and for those of the batch engine
 * (env/batch_step.h) with Real = float. On a GPU a tile has an environment (base/hd.h). */
#ifndef TASK_NUMBERS_H
#define TASK_NUMBERS_H

#include "base/hd.h"
#include "robot/limits.h"

#ifndef TASK_JOINTS /* sizes of a robot's arrays; where the code is compiled for one, its own */
#define TASK_JOINTS ROBOT_JOINTS_MAX
#define TASK_FEET ROBOT_FEET_MAX
#endif

/* What an environment keeps is a Real. Expressions are computed in double where they read the
 * task's definition or the robot's. */

#define TASK_PI 3.141592653589793
#define TASK_TWO_PI 6.283185307179586
#define TASK_PER_TURN 0.3183098861837907 /* 1/pi */

/* On a GPU to the accuracy of float, for a tenth of the instructions. */
MILD_HD_FN Real task_exp(double x) {
    return ON_GPU(expf((float)x), (Real)exp(x));
}

/* sinf has a long path for large x. */
MILD_HD_FN Real task_sin(double x) {
    return ON_GPU(sinpif((float)(x * TASK_PER_TURN)), (Real)sin(x));
}

MILD_HD_FN Real task_cos(double x) {
    return ON_GPU(cospif((float)(x * TASK_PER_TURN)), (Real)cos(x));
}

MILD_HD_FN Real task_sqrt(double x) {
    return ON_GPU(sqrtf((float)x), (Real)sqrt(x));
}

MILD_HD_FN Real task_square(Real x) {
    return x * x;
}

MILD_HD_FN Real task_clamp(Real x, Real low, Real high) {
    return x < low ? low : x > high ? high : x;
}

/* A number of a frame that is kept for the means of the history. Where Real is float it has 16
 * bits, with a rounding error of at most 2^-11 of the number: the noise of sensors is a hundred
 * times larger. */
#ifdef MILD_REAL_FLOAT
typedef uint16_t TaskFrame;

MILD_HD_FN TaskFrame frame_pack(float x) {
    return half_pack(x);
}

MILD_HD_FN float frame_unpack(TaskFrame frame) {
    return half_unpack(frame);
}
#else
typedef float TaskFrame;

MILD_HD_FN TaskFrame frame_pack(float x) {
    return x;
}

MILD_HD_FN float frame_unpack(TaskFrame frame) {
    return frame;
}
#endif

#endif
