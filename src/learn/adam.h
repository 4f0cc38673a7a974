/* Adam (Kingma & Ba 2015) over a range of flat arrays. */
#ifndef MILD_ADAM_H
#define MILD_ADAM_H

#include <stdint.h>

typedef struct {
    float step_size;      /* learning rate / (1 - beta1^t) */
    float second_scale;   /* 1 / (1 - beta2^t) */
    float gradient_scale; /* from clipping the gradient's norm */
} AdamStep;

/* t: number of this step, from 1. */
AdamStep adam_step(double learning_rate, int64_t t, double gradient_scale);
void adam_apply(AdamStep step, int64_t count, const float *gradient, float *parameters,
                float *first, float *second);

#endif
