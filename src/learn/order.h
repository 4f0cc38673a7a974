/* Order of the samples in an epoch: a pure function of (seed, iteration, epoch), the same on CPU
 * and GPU and for any number of threads, devices and processes.
 *
 * The environments are cut into ppo.shards runs of equal length, the strata. Sample k of a stratum
 * is step k / width of environment first + k % width. Every epoch permutes the n samples of each
 * stratum; shard s of minibatch m of M holds places n m / M .. n (m + 1) / M - 1 of stratum s. So a
 * process that has all environments of a stratum has all samples of its shards.
 *
 * The permutation is a Feistel network (Luby and Rackoff 1988) over the smallest power of two that
 * holds n, walked along its cycle until it is back among 0 .. n - 1 (Black and Rogaway 2002).
 * Written in the common subset of C17 and CUDA C++. */
#ifndef MILD_ORDER_H
#define MILD_ORDER_H

#include <stdint.h>

#include "base/random.h"
#include "learn/noise.h"

/* Of a minibatch, at most; also of strata. Their number is ppo.shards, a power of two. */
#define PPO_SHARDS_MAX 64

/* Few rounds leave pairs of places correlated: with 8 of them, chi-square over the pairs of 40
 * places is that of chance, and with 16 over those of 3. */
#define ORDER_ROUNDS 16

/* First of `count` items in part `part` of `parts` equal runs. */
MILD_HD_FN int order_begin(int count, int part, int parts) {
    return (int)((int64_t)count * part / parts);
}

typedef struct {
    int first; /* environment */
    int width; /* environments */
    int count; /* samples: steps * width */
} OrderStratum;

MILD_HD_FN OrderStratum order_stratum(int shards, int steps, int envs, int stratum) {
    OrderStratum s;
    s.first = order_begin(envs, stratum, shards);
    s.width = order_begin(envs, stratum + 1, shards) - s.first;
    s.count = steps * s.width;
    return s;
}

/* Place of sample k of the stratum in the rollout [steps][envs]. */
MILD_HD_FN int order_sample(OrderStratum s, int envs, int k) {
    return k / s.width * envs + s.first + k % s.width;
}

/* Cuts [PPO_SHARDS_MAX + 1] of minibatch m of `minibatches`: shard s is cut[s] .. cut[s + 1] - 1 of
 * its samples; those beyond `shards` are empty. Returns the number of samples, the last cut. */
MILD_HD_FN int order_cuts(int shards, int steps, int envs, int m, int minibatches, int *cut) {
    cut[0] = 0;
    for (int s = 0; s < PPO_SHARDS_MAX; s++) {
        const int count = s < shards ? order_stratum(shards, steps, envs, s).count : 0;
        cut[s + 1] =
            cut[s] + order_begin(count, m + 1, minibatches) - order_begin(count, m, minibatches);
    }
    return cut[PPO_SHARDS_MAX];
}

/* The part of the rollout that one of several processes has: a run of whole strata. Its arrays are
 * [steps][width]. */
typedef struct {
    int all, envs;     /* strata and environments of the whole */
    int first, width;  /* first environment of the part; environments of the part */
    int shard, shards; /* first stratum and shard; strata of the part */
} OrderPart;

/* ranks divides all. */
MILD_HD_FN OrderPart order_part(int all, int envs, int rank, int ranks) {
    OrderPart part;
    part.all = all;
    part.envs = envs;
    part.shards = all / ranks;
    part.shard = rank * part.shards;
    part.first = order_begin(envs, part.shard, all);
    part.width = order_begin(envs, part.shard + part.shards, all) - part.first;
    return part;
}

/* The stratum in the arrays of the part; one of another process is empty. */
MILD_HD_FN OrderStratum order_part_stratum(int steps, OrderPart part, int stratum) {
    OrderStratum s = order_stratum(part.all, steps, part.envs, stratum);
    if (stratum < part.shard || stratum >= part.shard + part.shards) {
        s.width = s.count = 0;
    }
    s.first -= part.first;
    return s;
}

/* The part's own of these cuts of a minibatch: counted from its first sample; shards of other
 * processes are empty. Returns the number of its samples, own's last. */
static inline int order_own_cuts(OrderPart part, const int *cut, int *own) {
    const int begin = cut[part.shard], end = cut[part.shard + part.shards];
    for (int s = 0; s <= PPO_SHARDS_MAX; s++) {
        const int place = cut[s] < begin ? begin : cut[s];
        own[s] = (place > end ? end : place) - begin;
    }
    return own[PPO_SHARDS_MAX];
}

/* Samples of the part's shards in its largest minibatch. */
static inline int order_largest(int steps, OrderPart part, int minibatches) {
    int largest = 0;
    for (int m = 0; m < minibatches; m++) {
        int cut[PPO_SHARDS_MAX + 1];
        order_cuts(part.all, steps, part.envs, m, minibatches, cut);
        const int count = cut[part.shard + part.shards] - cut[part.shard];
        largest = count > largest ? count : largest;
    }
    return largest;
}

/* A permutation of 0 .. count - 1. */
typedef struct {
    uint32_t count;
    uint32_t key[2];
    uint32_t right_bits, left_mask, right_mask; /* halves of the power of two */
} Order;

MILD_HD_FN Order order_make(int count, uint64_t seed, int64_t iteration, int epoch, int stratum) {
    Random random = random_at(seed ^ 0x6f72646572u, (uint32_t)iteration, (uint32_t)epoch);
    random.use = (uint32_t)stratum;
    const uint64_t key = random_bits(&random);
    uint32_t bits = 0;
    while ((1u << bits) < (uint32_t)count) {
        bits++;
    }
    Order order;
    order.count = (uint32_t)count;
    order.key[0] = (uint32_t)key;
    order.key[1] = (uint32_t)(key >> 32);
    order.right_bits = (bits + 1) / 2;
    order.right_mask = (1u << order.right_bits) - 1u;
    order.left_mask = (1u << (bits - order.right_bits)) - 1u;
    return order;
}

/* What the permutation puts at this place. */
MILD_HD_FN int order_at(const Order *order, int place) {
    const uint32_t golden = 0x9e3779b9u;
    uint32_t x = (uint32_t)place;
    do {
        uint32_t left = x >> order->right_bits, right = x & order->right_mask;
        for (uint32_t round = 0; round < ORDER_ROUNDS; round += 2) {
            left ^= noise_mix((right + round * golden) ^ order->key[0]) & order->left_mask;
            right ^= noise_mix((left + (round + 1) * golden) ^ order->key[1]) & order->right_mask;
        }
        x = left << order->right_bits | right;
    } while (x >= order->count);
    return (int)x;
}

#endif
