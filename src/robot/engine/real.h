/* What the batch engine needs of the scalar type beyond base/hd.h, and of vectors of three. */
#ifndef MILD_ENGINE_REAL_H
#define MILD_ENGINE_REAL_H

#include "base/hd.h"

#ifdef MILD_REAL_FLOAT
#ifdef __CUDA_ARCH__
#define REAL_POW __powf /* powf has hundreds of instructions */
#else
#define REAL_POW powf
#endif
#define REAL_ROUNDING REAL(1e-6) /* a relative change that is rounding */
#else
#define REAL_POW pow
#define REAL_ROUNDING REAL(1e-13)
#endif

#if defined(__CUDA_ARCH__) && defined(MILD_REAL_FLOAT)
#define REAL_INVERSE_SQRT rsqrtf /* one instruction, right to 2 units in the last place */
#else
#define REAL_INVERSE_SQRT(x) (1 / REAL_SQRT(x))
#endif

/* [-] Sine and cosine of x [rad], a few turns at most. */
MILD_HD void real_sine_cosine(Real x, Real *sine, Real *cosine) {
#if defined(__CUDA_ARCH__) && defined(MILD_REAL_FLOAT)
    /* sincosf has a path for large x that keeps its work in local memory */
    sincospif(x * REAL(0.31830988618379067), sine, cosine);
#elif defined(MILD_REAL_FLOAT)
    *sine = sinf(x);
    *cosine = cosf(x);
#else
    *sine = sin(x);
    *cosine = cos(x);
#endif
}

/* Four numbers from and to memory, at multiples of 16 bytes: a GPU takes one instruction. */
MILD_HD void load4(const Real *memory, Real *x) {
#if defined(__CUDA_ARCH__) && defined(MILD_REAL_FLOAT)
    const float4 four = *(const float4 *)memory;
    x[0] = four.x;
    x[1] = four.y;
    x[2] = four.z;
    x[3] = four.w;
#else
    for (int k = 0; k < 4; k++) {
        x[k] = memory[k];
    }
#endif
}

MILD_HD void store4(const Real *x, Real *memory) {
#if defined(__CUDA_ARCH__) && defined(MILD_REAL_FLOAT)
    *(float4 *)memory = make_float4(x[0], x[1], x[2], x[3]);
#else
    for (int k = 0; k < 4; k++) {
        memory[k] = x[k];
    }
#endif
}

MILD_HD Real dot3(const Real *a, const Real *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Component k of a x b. */
MILD_HD Real cross_part(const Real *a, const Real *b, int k) {
    const int i = k == 2 ? 0 : k + 1;
    const int j = k == 0 ? 2 : k - 1;
    return a[i] * b[j] - a[j] * b[i];
}

MILD_HD void cross3(const Real *a, const Real *b, Real *out) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

MILD_HD void add_cross3(const Real *a, const Real *b, Real *out) {
    out[0] = out[0] + a[1] * b[2] - a[2] * b[1];
    out[1] = out[1] + a[2] * b[0] - a[0] * b[2];
    out[2] = out[2] + a[0] * b[1] - a[1] * b[0];
}

/* out = R v, R row major. */
MILD_HD void turn3(const Real *R, const Real *v, Real *out) {
    out[0] = R[0] * v[0] + R[1] * v[1] + R[2] * v[2];
    out[1] = R[3] * v[0] + R[4] * v[1] + R[5] * v[2];
    out[2] = R[6] * v[0] + R[7] * v[1] + R[8] * v[2];
}

/* out = S v, S symmetric: xx yy zz xy xz yz. */
MILD_HD void symmetric3(const Real *S, const Real *v, Real *out) {
    out[0] = S[0] * v[0] + S[3] * v[1] + S[4] * v[2];
    out[1] = S[3] * v[0] + S[1] * v[1] + S[5] * v[2];
    out[2] = S[4] * v[0] + S[5] * v[1] + S[2] * v[2];
}

#endif
