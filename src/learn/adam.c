#include "learn/adam.h"

void adam_apply(AdamStep step, int64_t count, const float *restrict gradient,
                float *restrict parameters, float *restrict first, float *restrict second) {
#pragma omp simd
    for (int64_t i = 0; i < count; i++) {
        adam_element(step, gradient[i], &parameters[i], &first[i], &second[i]);
    }
}
