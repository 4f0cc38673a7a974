/* Numbers rounded to float, for tests that compare float with double arithmetic. */
#ifndef ROUND_H
#define ROUND_H

#include <stddef.h>

#include "base/float.h"

static inline void kit_round(double *x, size_t count) {
    for (size_t i = 0; i < count; i++) {
        x[i] = float_rounded(x[i]);
    }
}

#endif
