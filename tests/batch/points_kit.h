/* Feet that transmit no moment: nothing changes how they turn. A force on one moves the others. */
#ifndef POINTS_KIT_H
#define POINTS_KIT_H

#include "ground/ground_kit.h"

static inline void kit_points(Kit *kit, uint64_t *random) {
    const int n = 6 * kit->feet;
    double together[6 * MILD_FEET_MAX];
    for (int i = 0; i < n; i++) {
        together[i] = i % 6 < 3 ? kit_uniform(random, -0.2, 0.2) : 0; /* [kg^-1/2] */
    }
    for (int i = 0; i < n * n; i++) {
        const int row = i / n, column = i % n;
        double *at = &kit->input.inverse_inertia[i];
        *at = row % 6 < 3 && column % 6 < 3 ? *at + together[row] * together[column] : 0;
    }
}

#endif
