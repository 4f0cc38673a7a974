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

#endif
