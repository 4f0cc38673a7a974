#include <math.h>

#include "task/task.h"

#define TWO_PI 6.283185307179586

int task_is_standing(const double command[3]) {
    return fabs(command[0]) < 0.1 && fabs(command[1]) < 0.1 && fabs(command[2]) < 0.1;
}

/* Left stands in the first half of the period, right in the second. */
static double swing_progress(double phase, int foot) {
    double p = foot == ROBOT_FOOT_LEFT ? phase - 0.5 : phase;
    return p < 0 || p >= 0.5 ? -1 : 2 * p;
}

int task_gait_stance(double phase, int standing, int foot) {
    return standing || swing_progress(phase, foot) < 0;
}

/* h_des = apex sin(pi s), s the progress of the swing: the foot leaves and meets h0 on time. */
double task_gait_height(const TaskDef *def, double phase, int standing, int foot) {
    double s = swing_progress(phase, foot);
    return standing || s < 0 ? 0 : def->swing_apex * sin(0.5 * TWO_PI * s);
}

/* Vendor's reference: the swing leg bends by (-A, 2A, -A) |sin| in hip pitch, knee, ankle pitch. */
void task_gait_reference(const TaskDef *def, const double *pose, double phase, int standing,
                         double q[ROBOT_JOINTS]) {
    for (int i = 0; i < ROBOT_JOINTS; i++) {
        q[i] = pose[i];
    }
    double wave = standing ? 0 : sin(TWO_PI * phase);
    if (fabs(wave) < def->double_support) {
        return;
    }
    int first = wave < 0 ? 0 : 6;
    double bend = def->reward.reference_amplitude * fabs(wave);
    q[first + 2] -= bend;
    q[first + 3] += 2 * bend;
    q[first + 4] -= bend;
}
