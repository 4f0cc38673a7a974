#include "learn/noise.h"

#define NOISE_BLOCK 64

static void noise_block(uint32_t key0, uint32_t key1, uint32_t pair, float *restrict even,
                        float *restrict odd) {
#pragma omp simd
    for (int i = 0; i < NOISE_BLOCK; i++) {
        noise_pair(key0, key1, pair + (uint32_t)i, &even[i], &odd[i]);
    }
}

void noise_normal(uint64_t key, int64_t first, int count, float *out) {
    uint32_t key0 = (uint32_t)key, key1 = (uint32_t)(key >> 32);
    float even[NOISE_BLOCK], odd[NOISE_BLOCK];
    if (first % 2 != 0 && count > 0) { /* the second of a pair */
        noise_pair(key0, key1, (uint32_t)(first / 2), even, out);
        first++, count--, out++;
    }
    for (int done = 0; done < count; done += 2 * NOISE_BLOCK) {
        noise_block(key0, key1, (uint32_t)((first + done) / 2), even, odd);
        int left = count - done < 2 * NOISE_BLOCK ? count - done : 2 * NOISE_BLOCK;
        for (int i = 0; i < left; i++) {
            out[done + i] = i % 2 ? odd[i / 2] : even[i / 2];
        }
    }
}
