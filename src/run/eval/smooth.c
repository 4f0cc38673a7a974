#include "run/eval/smooth.h"

#include <math.h>
#include <string.h>

/* The base's angular velocity and the joints' speeds are those of the end of the step. */
static void take_state(Smooth *s, const EnvsSample *after) {
    const double *w = after->omega;
    double joint = 0;
    for (int i = 0; i < after->joints; i++) {
        joint += after->speed[i] * after->speed[i];
    }
    s->tilt += w[0] * w[0] + w[1] * w[1];
    s->yaw += w[2] * w[2];
    s->joint += joint / after->joints;
    s->counted++;
}

static void take_target(Smooth *s, int counts, const double *target, int joints) {
    double jerk = 0, jump = 0;
    for (int i = 0; i < joints; i++) {
        const double change = target[i] - s->target[SMOOTH_JERK_STEPS - 1][i];
        jerk += change * change;
        jump = fmax(jump, fabs(target[i] - s->target[0][i]));
    }
    if (counts) {
        s->jerk += jerk / joints;
        s->jump = fmax(s->jump, jump);
        s->targets++;
    }
    memmove(s->target[1], s->target[0], (SMOOTH_JERK_STEPS - 1) * sizeof *s->target);
    memcpy(s->target[0], target, (size_t)joints * sizeof *target);
}

void smooth_take(Smooth *s, double from, double period, const EnvsSample *after,
                 const float *action, double scale, double clip) {
    const int counts = s->steps >= SMOOTH_JERK_STEPS && s->steps * period >= from;
    double target[ROBOT_JOINTS_MAX];
    if (counts) {
        take_state(s, after);
    }
    if (action) {
        for (int i = 0; i < after->joints; i++) {
            target[i] = scale * fmin(fmax((double)action[i], -clip), clip);
        }
        take_target(s, counts, target, after->joints);
    }
    s->steps++;
}

void smooth_add(Smooth *sum, const Smooth *trial) {
    sum->counted += trial->counted;
    sum->targets += trial->targets;
    sum->tilt += trial->tilt;
    sum->yaw += trial->yaw;
    sum->joint += trial->joint;
    sum->jerk += trial->jerk;
    sum->jump = fmax(sum->jump, trial->jump);
}

/* Root of a mean; NaN of nothing. */
static double root(double sum, int count) {
    return count ? sqrt(sum / count) : NAN;
}

Smoothness smooth_result(const Smooth *sum) {
    return (Smoothness){.target_jump = sum->targets ? sum->jump : NAN,
                        .action_jerk = root(sum->jerk, sum->targets) / SMOOTH_JERK_UNIT,
                        .tilt_rate = root(sum->tilt, sum->counted),
                        .yaw_rate = root(sum->yaw, sum->counted),
                        .joint_speed = root(sum->joint, sum->counted)};
}
