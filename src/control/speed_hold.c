#include "control/speed_hold.h"

#include <math.h>
#include <string.h>

#include "env/task/state.h"

#define ERROR_MAX 0.5   /* [-] of the speed of one cycle */
#define SPEED_MIN 0.1   /* [m/s, rad/s] of a command whose ratio can be learned */
#define CHANGE_MAX 0.01 /* [m/s, rad/s] of the command that begins anew */
#define TURNING_MAX 0.4 /* [rad/s] of a command in a cycle that r of the speeds can learn from */
#define SETTLING 2      /* cycles after that */
#define ACCELERATION 1  /* [m/s^2] with which a robot comes to another speed, at least */
#define LATE_MAX 5      /* [s] a command that never rests */
#define YAW_RATE 2      /* place in a frame [rad/s] */

static const double ratio_max[3] = {0.2, 0.2, 0.4}; /* [-] */
/* The numbers of a command that are a part's: from the first to before the next part's. */
static const int first_of[SPEED_HOLD_PARTS + 1] = {TASK_FORWARD, TASK_TURN, TASK_TURN + 1};

static void learn(SpeedHold *hold, int part, double gain) {
    const double n = ++hold->cycles[part], share = fmax(gain, 1 / n), weight = n * n / (n * n + 1);
    for (int i = first_of[part]; i < first_of[part + 1]; i++) {
        if (fabs(hold->wanted[i]) >= SPEED_MIN) {
            const double command = hold->wanted[i] * (1 + hold->ratio[i]);
            const double factor = hold->way[i] / hold->steps / command;
            hold->mean[i] +=
                share * (fmax(fmin(factor, 1 + ERROR_MAX), 1 - ERROR_MAX) - hold->mean[i]);
            const double known = 1 + hold->before[i],
                         now = known + weight * (hold->mean[i] - known);
            hold->ratio[i] = fmax(fmin(1 / now - 1, ratio_max[i]), -ratio_max[i]);
        }
    }
}

static void pass_cycle(SpeedHold *hold, double gain) {
    for (int part = 0; part < SPEED_HOLD_PARTS; part++) {
        const int useless = part == SPEED_HOLD_LINEAR && hold->turning;
        if (hold->begun && hold->settling[part] == 0 && !useless) {
            learn(hold, part, gain);
        }
        const int last = part == SPEED_HOLD_LINEAR && hold->late > 0 ? 1 : 0;
        hold->settling[part] -= hold->settling[part] > last;
    }
    hold->begun = 1;
    hold->turning = hold->steps = 0;
    memset(hold->way, 0, sizeof hold->way);
}

/* What was learned is where it goes on from. */
static void begin_anew(SpeedHold *hold, int part, const double command[3]) {
    hold->settling[part] = SETTLING;
    hold->cycles[part] = 0;
    if (part == SPEED_HOLD_LINEAR) {
        hold->late += hypot(command[TASK_FORWARD] - hold->wanted[TASK_FORWARD],
                            command[TASK_LEFT] - hold->wanted[TASK_LEFT]) /
                      ACCELERATION;
        hold->late = fmin(hold->late, LATE_MAX);
    }
    for (int i = first_of[part]; i < first_of[part + 1]; i++) {
        hold->wanted[i] = command[i];
        hold->before[i] = 1 / (1 + hold->ratio[i]) - 1;
    }
}

static int has_changed(const SpeedHold *hold, int part, const double command[3]) {
    int changed = 0;
    for (int i = first_of[part]; i < first_of[part + 1]; i++) {
        changed |= fabs(command[i] - hold->wanted[i]) > CHANGE_MAX;
    }
    return changed;
}

void speed_hold(SpeedHold *hold, const SpeedHoldDef *def, const float *frame,
                const float *estimates, double command[3]) {
    if (def->gain == 0) {
        return;
    }
    const double sine = (double)frame[def->clock], cosine = (double)frame[def->clock + 1];
    if (sine == 0 && cosine == 0) { /* it stands */
        *hold = (SpeedHold){.settling = {SETTLING, SETTLING}};
        return;
    }
    hold->late = fmax(hold->late - TASK_PERIOD, 0);
    for (int part = 0; part < SPEED_HOLD_PARTS; part++) {
        if (has_changed(hold, part, command)) {
            begin_anew(hold, part, command);
        }
    }
    hold->steps++;
    hold->turning |= fabs(command[TASK_TURN]) > TURNING_MAX;
    hold->way[TASK_FORWARD] += (double)estimates[0] / def->scale;
    hold->way[TASK_LEFT] += (double)estimates[1] / def->scale;
    hold->way[TASK_TURN] += (double)frame[YAW_RATE];
    if (hold->sine < 0 && sine >= 0 && cosine > 0) {
        pass_cycle(hold, def->gain);
    }
    hold->sine = sine;
    for (int i = 0; i < 3; i++) {
        command[i] *= 1 + hold->ratio[i];
    }
    if (def->most > 0) {
        command[TASK_FORWARD] =
            fmin(command[TASK_FORWARD], fmax(hold->wanted[TASK_FORWARD], def->most));
    }
}
