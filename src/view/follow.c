#include "view/follow.h"

#include <math.h>
#include <string.h>

/* First-order low-pass filter, x' = (u - x)/lag, exact for an input that goes evenly from u0 to u1
 * in the time elapsed: x = u1 - s lag + (x0 - u0 + s lag) exp(-elapsed/lag), s = (u1 - u0)/elapsed.
 */
static double filtered(double x0, double u0, double u1, double elapsed, double lag) {
    double behind = lag * (u1 - u0) / elapsed;
    return u1 - behind + (x0 - u0 + behind) * exp(-elapsed / lag);
}

void follow_jump(Follow *follow, const double target[3]) {
    for (int k = 0; k < 3; k++) {
        follow->once[k] = follow->twice[k] = follow->target[k] = target[k];
    }
}

void follow_step(Follow *follow, const double target[3], double elapsed, double lag) {
    if (!(elapsed > 0)) {
        return;
    }
    for (int k = 0; k < 3; k++) {
        double before = follow->once[k];
        follow->once[k] = filtered(before, follow->target[k], target[k], elapsed, lag);
        follow->twice[k] = filtered(follow->twice[k], before, follow->once[k], elapsed, lag);
    }
    memcpy(follow->target, target, sizeof follow->target);
}

/* Behind a target that moves evenly, the first filter stays speed lag and the second twice that. */
void follow_position(const Follow *follow, double position[3]) {
    for (int k = 0; k < 3; k++) {
        position[k] = 2 * follow->once[k] - follow->twice[k];
    }
}
