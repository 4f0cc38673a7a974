/* The state of a policy, for the learner. */
#ifndef MILD_POLICY_PRIVATE_H
#define MILD_POLICY_PRIVATE_H

#include "base/pool.h"
#include "learn/network.h"
#include "learn/order.h"

struct Policy {
    Network network;
    float *parameters; /* [network.count] */
    float *std;        /* [actions] */
    float *scratch;    /* POLICY_SLOTS areas of slot_floats */
    size_t slot_floats;
};

/* Rows in blocks of equal length. A block is cut into runs, and no chunk of rows that goes through
 * the networks reaches over a cut. */
typedef struct {
    int bf16; /* bool: factors of products are rounded (product_enter) */
    int blocks, runs;
    int cut[PPO_SHARDS_MAX + 1]; /* run r of a block is rows cut[r] .. cut[r + 1] - 1; cut[0] = 0 */
} PolicyRows;

/* policy_act, and critic values [rows] for critic inputs [rows][critic_input]. Pool may be NULL.
 * noise: [rows][latent] of z, or NULL. */
void policy_act_rows(struct Policy *policy, Pool *pool, const PolicyRows *rows,
                     const float *history, const float *noise, float *actions);
void policy_value_rows(struct Policy *policy, Pool *pool, const PolicyRows *rows,
                       const float *critic, float *values);

#endif
