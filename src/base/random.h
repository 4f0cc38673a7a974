/* Counter-based random numbers (Philox 2x32-10, Salmon et al. 2011). A value is a pure function of
 * (seed, stream, step, use), so a run does not depend on the number of threads or devices. */
#ifndef MILD_RANDOM_H
#define MILD_RANDOM_H

#include <math.h>
#include <stdint.h>

#include "base/hd.h"

typedef struct {
    uint64_t seed;
    uint32_t stream; /* environment, layer, ... */
    uint32_t step;   /* time */
    uint32_t use;    /* running counter inside (stream, step) */
} Random;

MILD_HD_FN uint64_t random_mix(uint64_t x) {
    x ^= x >> 30;
    x *= 0xbf58476d1ce4e5b9u;
    x ^= x >> 27;
    x *= 0x94d049bb133111ebu;
    return x ^ (x >> 31);
}

MILD_HD_FN Random random_at(uint64_t seed, uint32_t stream, uint32_t step) {
    const Random random = {seed, stream, step, 0};
    return random;
}

/* The same numbers from the count-th on, for loops whose rounds draw apart. */
MILD_HD_FN Random random_after(Random r, int count) {
    r.use += (uint32_t)count;
    return r;
}

/* 64 random bits. The key is derived from (seed, stream); the counter is (step, use). */
MILD_HD_FN uint64_t random_bits(Random *r) {
    uint32_t x0 = r->step, x1 = r->use++;
    uint64_t k64 = random_mix(r->seed + 0x9e3779b97f4a7c15u * ((uint64_t)r->stream + 1u));
    uint32_t key = (uint32_t)(k64 ^ (k64 >> 32));
    x1 ^= (uint32_t)(k64 >> 32) * 0x9e3779b9u;
    for (int round = 0; round < 10; round++) {
        uint64_t product = (uint64_t)x0 * 0xd256d193u;
        x0 = (uint32_t)(product >> 32) ^ key ^ x1;
        x1 = (uint32_t)product;
        key += 0x9e3779b9u;
    }
    return ((uint64_t)x0 << 32) | x1;
}

/* Uniform in [0, 1). */
MILD_HD_FN double random_unit(Random *r) {
    return (double)(random_bits(r) >> 11) * 0x1.0p-53;
}

MILD_HD_FN double random_uniform(Random *r, double low, double high) {
    return low + (high - low) * random_unit(r);
}

/* Integer in [0, count). */
MILD_HD_FN uint32_t random_index(Random *r, uint32_t count) {
    return (uint32_t)(((random_bits(r) >> 32) * (uint64_t)count) >> 32);
}

/* Standard normal (Box-Muller, one of the pair). */
static inline double random_normal(Random *r) {
    double u = 1.0 - random_unit(r), v = random_unit(r);
    return sqrt(-2.0 * log(u)) * cos(6.283185307179586 * v);
}

#endif
