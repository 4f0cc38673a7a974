#include "ground/step/moments.h"

#include <string.h>

#ifdef MILD_REAL_FLOAT
/* In halves: sixteen in a row would take as long as the loop before them. */
void lanes_sum(const Lanes *lanes, int count, double *sums) {
    for (int k = 0; k < count; k++) {
        Lanes part;
        memcpy(part, lanes[k], sizeof part);
#pragma GCC unroll 4
        for (int half = SLOT_LANES / 2; half > 0; half /= 2) {
#pragma omp simd
            for (int l = 0; l < half; l++) {
                part[l] += part[l + half];
            }
        }
        sums[k] = (double)part[0];
    }
}
#else
void lanes_sum(const Lanes *lanes, int count, double *sums) {
    for (int k = 0; k < count; k++) {
        double sum = 0.0;
        for (int l = 0; l < SLOT_LANES; l++) {
            sum += lanes[k][l];
        }
        sums[k] = sum;
    }
}
#endif

void moments(const Real *xs, const Real *ys, int end, const Real *a, const Real *b, const Real *c,
             double sums[3][6]) {
    LaneVector A[6] = {{0.0}}, B[6] = {{0.0}}, C[6] = {{0.0}};
    for (int i = 0; i < end * (int)SLOT_NUMBERS; i += SLOT_LANES * (int)SLOT_NUMBERS) {
        const LaneVector x = lanes_load(xs + i), y = lanes_load(ys + i);
        const LaneVector xx = x * x, xy = x * y, yy = y * y;
        const LaneVector p = lanes_load(a + i), q = lanes_load(b + i), r = lanes_load(c + i);
        A[0] += p;
        A[1] += p * x;
        A[2] += p * y;
        A[3] += p * xx;
        A[4] += p * xy;
        A[5] += p * yy;
        B[0] += q;
        B[1] += q * x;
        B[2] += q * y;
        B[3] += q * xx;
        B[4] += q * xy;
        B[5] += q * yy;
        C[0] += r;
        C[1] += r * x;
        C[2] += r * y;
        C[3] += r * xx;
        C[4] += r * xy;
        C[5] += r * yy;
    }
    lanes_sum((const Lanes *)A, 6, sums[0]);
    lanes_sum((const Lanes *)B, 6, sums[1]);
    lanes_sum((const Lanes *)C, 6, sums[2]);
}
