#include "ground/moments.h"

#include <string.h>

#include "ground/state.h"

void moments(const double *xs, const double *ys, int end, const double *a, const double *b,
             const double *c, double sums[3][6]) {
    if (end < VECTOR_LANES) { /* never, as in foot_frictions */
        memset(sums, 0, 3 * sizeof *sums);
        return;
    }
    end &= -VECTOR_LANES; /* changes nothing; the compiler sees that no element is left over */
    double a0 = 0.0, a1 = 0.0, a2 = 0.0, a3 = 0.0, a4 = 0.0, a5 = 0.0;
    double b0 = 0.0, b1 = 0.0, b2 = 0.0, b3 = 0.0, b4 = 0.0, b5 = 0.0;
    double c0 = 0.0, c1 = 0.0, c2 = 0.0, c3 = 0.0, c4 = 0.0, c5 = 0.0;
#pragma omp simd reduction(+ : a0, a1, a2, a3, a4, a5, b0, b1, b2, b3, b4, b5, c0, c1, c2, c3, c4, \
                               c5)
    for (int i = 0; i < end; i++) {
        double x = xs[i], y = ys[i], xx = x * x, xy = x * y, yy = y * y;
        a0 += a[i];
        a1 += a[i] * x;
        a2 += a[i] * y;
        a3 += a[i] * xx;
        a4 += a[i] * xy;
        a5 += a[i] * yy;
        b0 += b[i];
        b1 += b[i] * x;
        b2 += b[i] * y;
        b3 += b[i] * xx;
        b4 += b[i] * xy;
        b5 += b[i] * yy;
        c0 += c[i];
        c1 += c[i] * x;
        c2 += c[i] * y;
        c3 += c[i] * xx;
        c4 += c[i] * xy;
        c5 += c[i] * yy;
    }
    const double all[3][6] = {
        {a0, a1, a2, a3, a4, a5}, {b0, b1, b2, b3, b4, b5}, {c0, c1, c2, c3, c4, c5}};
    memcpy(sums, all, sizeof all);
}
