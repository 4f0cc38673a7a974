/* The state of a policy, for the learner. */
#ifndef MILD_POLICY_PRIVATE_H
#define MILD_POLICY_PRIVATE_H

#include "learn/network.h"

struct Policy {
    Network network;
    float *parameters; /* [network.count] */
    float *std;        /* [actions] */
    float *scratch;    /* POLICY_SLOTS areas of slot_floats */
    size_t slot_floats;
};

#endif
