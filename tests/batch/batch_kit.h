/* What the tests of batches share. */
#ifndef BATCH_KIT_H
#define BATCH_KIT_H

#include "device/device.h"
#include "ground/batch/batch.h"
#include "ground/ground_kit.h"

/* Bool, said when it is not there. */
static inline int has_device(void) {
    MildError error = {0};
    const int there = device_open(0, &error) == MILD_OK;
    if (!there) {
        print_message("no device: %s\n", error.text);
    }
    return there;
}

static inline void to_float(float *to, const double *from, int count) {
    for (int i = 0; i < count; i++) {
        to[i] = (float)from[i];
    }
}

/* For qsort. */
static inline int ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Feet that transmit no moment: nothing changes how they turn. A force on one moves the others. */

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
