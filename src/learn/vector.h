/* Elementwise functions without branches or calls, so that compilers vectorise their loops. */
#ifndef MILD_VECTOR_H
#define MILD_VECTOR_H

#include <stdint.h>
#include <string.h>

#include "base/hd.h"

/* e^x to 3e-7 relative for x in [-87, 88]; clamped outside; NaN stays NaN.
 * e^x = 2^n e^r, n = round(x / ln 2), |r| <= ln(2)/2, e^r by its Taylor series to r^6/720
 * (error 1.2e-7 relative). */
MILD_HD_FN float vector_exp(float x) {
    const float shift =
        12582912.0f; /* 1.5 * 2^23: adding it rounds to an integer held in the low bits */
    float held = x < -87.0f ? -87.0f : x;
    held = held > 88.0f ? 88.0f : held;
    float rounded = held * 1.44269504088896341f + shift;
    float n = rounded - shift;
    float r = (held - n * 0.693145751953125f) - n * 1.42860682030941723e-6f;
    float p = 1.0f / 720.0f;
    p = p * r + 1.0f / 120.0f;
    p = p * r + 1.0f / 24.0f;
    p = p * r + 1.0f / 6.0f;
    p = p * r + 0.5f;
    p = p * r + 1.0f;
    p = p * r + 1.0f;
    uint32_t bits;
    memcpy(&bits, &rounded, sizeof bits);
    bits = (bits + 127u) << 23; /* 2^n; the upper bits are shifted out */
    float scale;
    memcpy(&scale, &bits, sizeof scale);
    return p * scale;
}

/* Exponential linear unit, and its derivative from the output y: 1 for y > 0, else e^x = y + 1. */
MILD_HD_FN float vector_elu(float x) {
    float negative = vector_exp(x > 0.0f ? 0.0f : x) - 1.0f;
    return x > 0.0f ? x : negative;
}

MILD_HD_FN float vector_elu_slope(float y) {
    return y > 0.0f ? 1.0f : y + 1.0f;
}

/* Softsign x / (1 + |x|), and its derivative from the output y: (1 - |y|)^2. */
MILD_HD_FN float vector_softsign(float x) {
    return x / (1.0f + (x < 0.0f ? -x : x));
}

MILD_HD_FN float vector_softsign_slope(float y) {
    const float left = 1.0f - (y < 0.0f ? -y : y);
    return left * left;
}

/* Natural logarithm to 2e-7 for normal positive x. x = 2^e m with m in [sqrt(1/2), sqrt(2)); with s
 * = (m-1)/(m+1), ln m = 2 (s + s^3/3 + s^5/5 + ...), |s| <= 0.172, cut after s^9/9. */
MILD_HD_FN float vector_log(float x) {
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    int32_t exponent = (int32_t)((bits - 0x3f3504f3u) >> 23);
    exponent = exponent > 255 ? exponent - 512 : exponent;
    bits -= (uint32_t)exponent << 23;
    float m;
    memcpy(&m, &bits, sizeof m);
    float s = (m - 1.0f) / (m + 1.0f), q = s * s;
    float series = ((q * (1.0f / 9.0f) + 1.0f / 7.0f) * q + 0.2f) * q + 1.0f / 3.0f;
    return (float)exponent * 0.69314718055994531f + 2.0f * s * (1.0f + q * series);
}

#endif
