/* Adam (Kingma & Ba 2015), for CPU (adam.c) and GPU (cuda/update.cu). Written in the common subset
 * of C17 and CUDA C++. */
#ifndef MILD_ADAM_H
#define MILD_ADAM_H

#include <math.h>
#include <stdint.h>

#include "base/hd.h"

#define ADAM_BETA1 0.9
#define ADAM_BETA2 0.999
#define ADAM_EPSILON 1e-8f

typedef struct {
    float step_size;      /* learning rate / (1 - beta1^t) */
    float second_scale;   /* 1 / (1 - beta2^t) */
    float gradient_scale; /* from clipping the gradient's norm */
} AdamStep;

/* t: number of this step, from 1. */
MILD_HD_FN AdamStep adam_step(double learning_rate, int64_t t, double gradient_scale) {
    AdamStep step;
    step.step_size = (float)(learning_rate / (1.0 - pow(ADAM_BETA1, (double)t)));
    step.second_scale = (float)(1.0 / (1.0 - pow(ADAM_BETA2, (double)t)));
    step.gradient_scale = (float)gradient_scale;
    return step;
}

/* m = b1 m + (1-b1) g, v = b2 v + (1-b2) g^2, p -= lr m^ / (sqrt(v^) + eps), with m^ and v^
 * corrected for their bias towards 0. */
MILD_HD_FN void adam_element(AdamStep step, float gradient, float *parameter, float *first,
                             float *second) {
    const float g = gradient * step.gradient_scale;
    const float m = (float)ADAM_BETA1 * *first + (float)(1.0 - ADAM_BETA1) * g;
    const float v = (float)ADAM_BETA2 * *second + (float)(1.0 - ADAM_BETA2) * g * g;
    *first = m;
    *second = v;
    *parameter -= step.step_size * m / (sqrtf(v * step.second_scale) + ADAM_EPSILON);
}

/* Over a range of flat arrays. */
void adam_apply(AdamStep step, int64_t count, const float *gradient, float *parameters,
                float *first, float *second);

#endif
