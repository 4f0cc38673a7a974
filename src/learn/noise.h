/* Standard normal numbers in bulk: number i of a stream is a function of (key, i) alone. */
#ifndef MILD_NOISE_H
#define MILD_NOISE_H

#include <math.h>
#include <stdint.h>

#include "learn/vector.h"

/* Writes numbers first .. first+count-1 of the stream `key` to out.
 * Box-Muller on 24-bit uniforms, so |number| <= 5.77. */
void noise_normal(uint64_t key, int64_t first, int count, float *out);

/* 32-bit integer hash, a bijection without visible bias (Wellons 2018, "lowbias32"). */
MILD_HD_FN uint32_t noise_mix(uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

/* sin(pi a) and cos(pi a) for a in [-1/2, 1/2): Taylor series to a^11 and a^12, error below 1e-7.
 */
MILD_HD_FN float noise_sin(float a) {
    float q = a * a;
    float p = -0.0073704309f;
    p = p * q + 0.0821458866f;
    p = p * q - 0.5992645293f;
    p = p * q + 2.5501640399f;
    p = p * q - 5.1677127800f;
    return a * (p * q + 3.1415926536f);
}

MILD_HD_FN float noise_cos(float a) {
    float q = a * a;
    float p = 0.0019295743f;
    p = p * q - 0.0258068913f;
    p = p * q + 0.2353306303f;
    p = p * q - 1.3352627689f;
    p = p * q + 4.0587121264f;
    p = p * q - 4.9348022005f;
    return p * q + 1.0f;
}

/* Numbers 2 pair and 2 pair + 1 of the stream: radius sqrt(-2 ln u), angle 2 pi v. The angle is a
 * uniform half turn with a random sign in front, which keeps the series' argument small. */
MILD_HD_FN void noise_pair(uint32_t key0, uint32_t key1, uint32_t pair, float *even, float *odd) {
    uint32_t counter = pair * 0x9e3779b9u;
    uint32_t h0 = noise_mix(counter ^ key0), h1 = noise_mix(noise_mix(counter + key1) ^ key0);
    float u = (float)(int32_t)((h0 >> 8) + 1u) * 0x1.0p-24f;
    float a = (float)(int32_t)(h1 >> 8) * 0x1.0p-24f - 0.5f;
    float radius = sqrtf(-2.0f * vector_log(u));
    radius = (h1 & 1u) ? -radius : radius;
    *even = radius * noise_cos(a);
    *odd = radius * noise_sin(a);
}

/* One number of the stream. */
MILD_HD_FN float noise_number(uint64_t key, int64_t number) {
    float even, odd;
    noise_pair((uint32_t)key, (uint32_t)(key >> 32), (uint32_t)(number / 2), &even, &odd);
    return number % 2 ? odd : even;
}

#endif
