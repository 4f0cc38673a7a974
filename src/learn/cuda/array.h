/* Numbers on their way through the networks: float or, with ppo.matmul = bf16, bfloat16, the upper
 * half of a float. */
#ifndef MILD_GPU_ARRAY_H
#define MILD_GPU_ARRAY_H

#include <stddef.h>
#include <stdint.h>

typedef struct {
    void *at;
    int bf16; /* bool */
} GpuArray;

static inline size_t gpu_array_bytes(int bf16, size_t count) {
    return count * (bf16 ? sizeof(uint16_t) : sizeof(float));
}

/* The array from one of its numbers on. */
static inline GpuArray gpu_array_from(GpuArray array, size_t number) {
    array.at = (char *)array.at + gpu_array_bytes(array.bf16, number);
    return array;
}

static inline GpuArray gpu_array_float(float *at) {
    const GpuArray array = {at, 0};
    return array;
}

#endif
