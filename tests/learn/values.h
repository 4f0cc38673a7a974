/* What the critic says of rows that lie together. */
#ifndef VALUES_H
#define VALUES_H

#include "learn/policy_private.h"

static inline void kit_values(struct Policy *policy, Pool *pool, int rows, const float *critic,
                              float *values) {
    const PolicyRows all = {.blocks = 1, .runs = 1, .cut = {0, rows}};
    policy_value_rows(policy, pool, &all, critic, values);
}

#endif
