/* Fused products on the CPU, with slices and pitches that are neither the rows nor the width. */
#include <math.h>
#include <string.h>

#include "cublas_v2.h"
#include "device/ranks/ranks.h"
#include "learn/cuda/fused.h"

enum { ROWS = 48, COLUMNS = 40 };

int gpu_fused_processors(int device) {
    (void)device;
    return 1;
}

static double dot(const void *a, long at, long a_step, const void *b, long from, long b_step,
                  int count) {
    double sum = 0.0;
    for (int k = 0; k < count; k++) {
        sum += (double)emulated_number(a, CUDA_R_16BF, at + k * a_step) *
               (double)emulated_number(b, CUDA_R_16BF, from + k * b_step);
    }
    return sum;
}

int gpu_fused_forward(cudaStream_t stream, int processors, int rows, int out, int in, const void *x,
                      const void *weight, const float *bias, void *y) {
    (void)stream, (void)processors;
    for (long r = 0; r < rows; r++) {
        for (long j = 0; j < out; j++) {
            const float sum = (float)dot(x, r * in, 1, weight, j * in, 1, in) + bias[j];
            emulated_write(y, CUDA_R_16BF, r * out + j, sum > 0.0f ? sum : expf(sum) - 1.0f);
        }
    }
    return 1;
}

GpuSlices gpu_fused_slices(int rows, int in) {
    return (GpuSlices){(rows + ROWS - 1) / ROWS, (in + COLUMNS - 1) / COLUMNS * COLUMNS};
}

int gpu_fused_backward(cudaStream_t stream, int processors, int rows, int out, int in,
                       const void *d, const void *weight, const void *y, void *to, float *partial) {
    (void)stream, (void)processors;
    const GpuSlices s = gpu_fused_slices(rows, in);
    memset(partial, 0xff, (size_t)s.slices * (size_t)s.pitch * sizeof *partial); /* NaN */
    for (long r = 0; r < rows; r++) {
        for (long j = 0; j < in; j++) {
            const float own = emulated_number(y, CUDA_R_16BF, r * in + j),
                        sum = (float)dot(d, r * out, 1, weight, j, in, out) *
                              (own > 0.0f ? 1.0f : own + 1.0f);
            float *add = partial + r / ROWS * s.pitch + j;
            *add = (r % ROWS == 0 ? 0.0f : *add) + sum;
            emulated_write(to, CUDA_R_16BF, r * in + j, sum);
        }
    }
    return 1;
}

/* ---- ranks/ranks.h where the device's memory is memory ---- */

MildStatus ranks_open_device(Ranks *ranks, size_t bytes, MildError *error) {
    (void)ranks, (void)bytes, (void)error;
    return MILD_OK;
}

MildStatus ranks_sum_device(Ranks *ranks, float *x, int64_t count, MildStream stream,
                            MildError *error) {
    (void)stream, (void)error;
    ranks_sum(ranks, x, count);
    return MILD_OK;
}

MildStatus ranks_sum_device_double(Ranks *ranks, double *x, int64_t count, MildStream stream,
                                   MildError *error) {
    (void)stream, (void)error;
    ranks_sum_double(ranks, x, count);
    return MILD_OK;
}

void ranks_close_device(Ranks *ranks) {
    (void)ranks;
}
