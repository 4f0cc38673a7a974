#include "learn/noise.h"

#include <assert.h>
#include <math.h>

#include "learn/vector.h"

/* 32-bit integer hash, a bijection without visible bias (Wellons 2018, "lowbias32"). */
static inline uint32_t noise_mix(uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ (x >> 16);
}

/* sin(pi a) and cos(pi a) for a in [-1/2, 1/2): Taylor series to a^11 and a^12, error below 1e-7. */
static inline float noise_sin(float a) {
    float q = a * a;
    float p = -0.0073704309f;
    p = p * q + 0.0821458866f;
    p = p * q - 0.5992645293f;
    p = p * q + 2.5501640399f;
    p = p * q - 5.1677127800f;
    return a * (p * q + 3.1415926536f);
}

static inline float noise_cos(float a) {
    float q = a * a;
    float p = 0.0019295743f;
    p = p * q - 0.0258068913f;
    p = p * q + 0.2353306303f;
    p = p * q - 1.3352627689f;
    p = p * q + 4.0587121264f;
    p = p * q - 4.9348022005f;
    return p * q + 1.0f;
}

#define NOISE_BLOCK 64

/* Pair p of the stream: radius sqrt(-2 ln u), angle 2 pi v. The angle is a uniform half turn with a random sign in front,
 * which keeps the series' argument small. */
static void noise_block(uint32_t key0, uint32_t key1, uint32_t pair, float *restrict even, float *restrict odd) {
#pragma omp simd
    for (int i = 0; i < NOISE_BLOCK; i++) {
        uint32_t counter = (pair + (uint32_t)i) * 0x9e3779b9u;
        uint32_t h0 = noise_mix(counter ^ key0), h1 = noise_mix(noise_mix(counter + key1) ^ key0);
        float u = (float)(int32_t)((h0 >> 8) + 1u) * 0x1.0p-24f;
        float a = (float)(int32_t)(h1 >> 8) * 0x1.0p-24f - 0.5f;
        float radius = sqrtf(-2.0f * vector_log(u));
        radius = (h1 & 1u) ? -radius : radius;
        even[i] = radius * noise_cos(a);
        odd[i] = radius * noise_sin(a);
    }
}

void noise_normal(uint64_t key, int64_t first, int count, float *out) {
    assert(first % 2 == 0);
    uint32_t key0 = (uint32_t)key, key1 = (uint32_t)(key >> 32);
    float even[NOISE_BLOCK], odd[NOISE_BLOCK];
    for (int done = 0; done < count; done += 2 * NOISE_BLOCK) {
        noise_block(key0, key1, (uint32_t)((first + done) / 2), even, odd);
        int left = count - done < 2 * NOISE_BLOCK ? count - done : 2 * NOISE_BLOCK;
        for (int i = 0; i < left; i++) {
            out[done + i] = i % 2 ? odd[i / 2] : even[i / 2];
        }
    }
}
