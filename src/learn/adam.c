#include "learn/adam.h"

#include <math.h>

#define BETA1 0.9
#define BETA2 0.999
#define EPSILON 1e-8f

AdamStep adam_step(double learning_rate, int64_t t, double gradient_scale) {
    return (AdamStep){
        .step_size = (float)(learning_rate / (1.0 - pow(BETA1, (double)t))),
        .second_scale = (float)(1.0 / (1.0 - pow(BETA2, (double)t))),
        .gradient_scale = (float)gradient_scale,
    };
}

/* m = b1 m + (1-b1) g, v = b2 v + (1-b2) g^2, p -= lr m^ / (sqrt(v^) + eps), with m^ and v^
 * corrected for their bias towards 0. */
void adam_apply(AdamStep step, int64_t count, const float *restrict gradient,
                float *restrict parameters, float *restrict first, float *restrict second) {
#pragma omp simd
    for (int64_t i = 0; i < count; i++) {
        float g = gradient[i] * step.gradient_scale;
        float m = (float)BETA1 * first[i] + (float)(1.0 - BETA1) * g;
        float v = (float)BETA2 * second[i] + (float)(1.0 - BETA2) * g * g;
        first[i] = m;
        second[i] = v;
        parameters[i] -= step.step_size * m / (sqrtf(v * step.second_scale) + EPSILON);
    }
}
