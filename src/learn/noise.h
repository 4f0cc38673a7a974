/* Standard normal numbers in bulk: number i of a stream is a function of (key, i) alone. */
#ifndef MILD_NOISE_H
#define MILD_NOISE_H

#include <stdint.h>

/* Writes numbers first .. first+count-1 of the stream `key` to out; `first` must be even. Box-Muller on 24-bit uniforms, so
 * |number| <= 5.77. */
void noise_normal(uint64_t key, int64_t first, int count, float *out);

#endif
