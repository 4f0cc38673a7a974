/* Vectors of three. */
#ifndef MILD_ENGINE_REAL_H
#define MILD_ENGINE_REAL_H

#include "base/hd.h"

MILD_HD Real dot3(const Real *a, const Real *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
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
