/* For estimates.py: the estimates and targets of a trial's steps, by the policy.c beside it. */
#include <string.h>

#include "policy.h"

void run(const float *frames, int steps, float *estimates, float *targets) {
    PolicyState state;
    float action[POLICY_JOINTS];
    policy_reset(&state);
    for (int k = 0; k < steps; k++) {
        policy_step(&state, frames + k * POLICY_OBSERVATION, action);
        memcpy(estimates + k * POLICY_ESTIMATES, state.estimates, sizeof state.estimates);
        policy_targets(action, targets + k * POLICY_JOINTS);
    }
}
