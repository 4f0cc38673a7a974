#include "control/speed_hold.h"

#include <math.h>
#include <string.h>

#define RATIO_MAX 0.2   /* [-] */
#define ERROR_MAX 0.5   /* [-] of the speed of one cycle */
#define SPEED_MIN 0.1   /* [m/s] of a command whose ratio can be learned */
#define CHANGE_MAX 0.01 /* [m/s] of the command that begins anew */
#define TURNING_MAX 0.4 /* [rad/s] of a command in a cycle that r can learn from */
#define SETTLING 2      /* cycles after that */

SpeedHoldDef speed_hold_def(const TaskDef *task, const Robot *robot, const Controller *controller) {
    return (SpeedHoldDef){.gain = controller->estimates ? task->speed_hold : 0,
                          .scale = task->velocity_scale,
                          .clock = task_shape(task, robot).observation - 2};
}

static void learn(SpeedHold *hold, double gain) {
    const double n = ++hold->cycles, share = fmax(gain, 1 / n), weight = n * n / (n * n + 1);
    for (int i = 0; i < 2; i++) {
        if (fabs(hold->wanted[i]) >= SPEED_MIN) {
            const double command = hold->wanted[i] * (1 + hold->ratio[i]);
            const double factor = hold->way[i] / hold->steps / command;
            hold->mean[i] +=
                share * (fmax(fmin(factor, 1 + ERROR_MAX), 1 - ERROR_MAX) - hold->mean[i]);
            const double known = 1 + hold->before[i],
                         now = known + weight * (hold->mean[i] - known);
            hold->ratio[i] = fmax(fmin(1 / now - 1, RATIO_MAX), -RATIO_MAX);
        }
    }
}

static void pass_cycle(SpeedHold *hold, double gain) {
    if (hold->begun && hold->settling == 0 && !hold->turning) {
        learn(hold, gain);
    }
    hold->settling -= hold->settling > 0;
    hold->begun = 1;
    hold->turning = hold->steps = 0;
    memset(hold->way, 0, sizeof hold->way);
}

/* What was learned is where it goes on from. */
static void begin_anew(SpeedHold *hold, const double command[2]) {
    hold->settling = SETTLING;
    hold->cycles = 0;
    for (int i = 0; i < 2; i++) {
        hold->wanted[i] = command[i];
        hold->before[i] = 1 / (1 + hold->ratio[i]) - 1;
    }
}

void speed_hold(SpeedHold *hold, const SpeedHoldDef *def, const float *frame,
                const float *estimates, double command[3]) {
    if (def->gain == 0) {
        return;
    }
    const double sine = (double)frame[def->clock], cosine = (double)frame[def->clock + 1];
    if (sine == 0 && cosine == 0) { /* it stands */
        *hold = (SpeedHold){.settling = SETTLING, .wanted = {command[0], command[1]}};
        return;
    }
    if (fabs(command[0] - hold->wanted[0]) > CHANGE_MAX ||
        fabs(command[1] - hold->wanted[1]) > CHANGE_MAX) {
        begin_anew(hold, command);
    }
    hold->steps++;
    hold->turning |= fabs(command[2]) > TURNING_MAX;
    for (int i = 0; i < 2; i++) {
        hold->way[i] += (double)estimates[i] / def->scale;
    }
    if (hold->sine < 0 && sine >= 0 && cosine > 0) {
        pass_cycle(hold, def->gain);
    }
    hold->sine = sine;
    command[0] *= 1 + hold->ratio[0];
    command[1] *= 1 + hold->ratio[1];
}
