/* The two optimisers, for CPU (optimiser.c) and GPU (cuda/update.cu, cuda/muon.c). Written in the
 * common subset of C17 and CUDA C++. */
#ifndef MILD_OPTIMISER_H
#define MILD_OPTIMISER_H

#include <math.h>
#include <stdint.h>

#include "base/hd.h"
#include "learn/network.h"

/* ---- Adam (Kingma & Ba 2015) ---- */

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

/* ---- Muon ---- */

/* Muon (Jordan et al. 2024, kellerjordan.github.io/posts/muon) for the weights between two hidden
 * layers, with steps as long as Adam's (Liu et al. 2025, arXiv:2502.16982, eq 4; no weight decay).
 * All other parameters stay with Adam.
 *
 *     M <- mu M + G                                               momentum
 *     X <- (G + mu M) / |G + mu M|                                Nesterov's direction, length 1
 *     X <- a X + b (X X^T) X + c (X X^T)^2 X, five times          Newton-Schulz
 *     W <- W - rate 0.2 sqrt(max(rows, columns)) X
 *
 * An iteration leaves the singular vectors of X and takes each singular value x to
 * a x + b x^3 + c x^5. Five of them take 0.0015 .. 1 to 0.68 .. 1.20. The root mean square of such
 * a matrix is 1 / sqrt(max(rows, columns)), and that of Adam's steps 0.2 to 0.4 of the rate. So one
 * learning rate, which the divergence adapts, serves both. */

#define MUON_MOMENTUM 0.95f
#define MUON_ITERATIONS 5
#define MUON_A 3.4445f
#define MUON_B (-4.7750f)
#define MUON_C 2.0315f

#define MUON_MATRICES_MAX (NETWORK_MLPS * (MLP_LAYERS_MAX - 2))

typedef struct {
    int rows, columns;
    int64_t at;  /* offset of its weights in the parameters */
    float scale; /* 0.2 sqrt(max(rows, columns)) */
} MuonMatrix;

/* In the order of the parameters. */
typedef struct {
    int count;
    MuonMatrix matrix[MUON_MATRICES_MAX];
} MuonMatrices;

/* M <- mu M + G. Returns G + mu M. */
MILD_HD_FN float muon_direction(float gradient, float *momentum) {
    *momentum = MUON_MOMENTUM * *momentum + gradient;
    return gradient + MUON_MOMENTUM * *momentum;
}

/* 1 / |X| from |X|^2, the trace of X X^T. The small number is Jordan's, against X = 0. */
MILD_HD_FN float muon_shrink(double trace) {
    return (float)(1.0 / (sqrt(trace) + 1e-7));
}

/* An element of P = s (a I + b s^2 A + c s^4 A A) with A = X X^T: P X is an iteration of s X. */
MILD_HD_FN float muon_polynomial(float s, int is_diagonal, float a, float aa) {
    const float s2 = s * s;
    return s * ((is_diagonal ? MUON_A : 0.0f) + s2 * (MUON_B * a + MUON_C * (s2 * aa)));
}

/* The weights of `network` between two hidden layers. */
MuonMatrices muon_matrices(const Network *network);
size_t muon_work_floats(const MuonMatrices *matrices); /* for the largest */

/* Brings the singular values of x [rows][columns] near 1. Returns where the result is: in x or in
 * `block` [muon_work_floats], which is aligned to 64 bytes. x is overwritten. */
float *muon_orthogonalise(const MuonMatrix *matrix, float *x, float *block);
/* One step of a matrix. The arrays are those of all parameters; its part of the gradient is
 * overwritten. */
void muon_apply(const MuonMatrix *matrix, double rate, float gradient_scale, float *gradient,
                float *parameters, float *momentum, float *work);

#endif
