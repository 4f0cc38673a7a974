/* Random numbers by SplitMix64, for tests of layers without base/random.h. */
#ifndef TEST_DRAWS_H
#define TEST_DRAWS_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#include "base/float.h"

static inline double kit_uniform(uint64_t *state, double low, double high) {
    uint64_t x = *state += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    x ^= x >> 31;
    return low + (high - low) * ((double)(x >> 11) * 0x1.0p-53);
}

static inline int kit_index(uint64_t *state, int count) {
    return (int)kit_uniform(state, 0.0, (double)count);
}

/* Log-uniform. */
static inline double kit_spread(uint64_t *state, double low, double high) {
    return exp(kit_uniform(state, log(low), log(high)));
}

/* ---- numbers rounded to float, for tests that compare float with double arithmetic ---- */

static inline void kit_round(double *x, size_t count) {
    for (size_t i = 0; i < count; i++) {
        x[i] = float_rounded(x[i]);
    }
}

#endif
