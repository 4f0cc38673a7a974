/* A product of bfloat16 with what a layer does before and after it, in one kernel, so that the
 * layer's numbers go through the memory once. CUTLASS's kernels for compute capability 9.0. Rows
 * are row-major, widths multiples of 8, arrays aligned to 16 bytes. The calls only enqueue; they
 * return 0 where that fails. */
#ifndef MILD_GPU_FUSED_H
#define MILD_GPU_FUSED_H

#include <cuda_runtime_api.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Multiprocessors of a device that has these kernels. 0: another device, or a build without
 * CUTLASS; then nothing below may be called. */
int gpu_fused_processors(int device);

/* y = elu(x W^T + bias). x [rows][in], weight [out][in], y [rows][out]; bias [out] in float. */
int gpu_fused_forward(cudaStream_t stream, int processors, int rows, int out, int in, const void *x,
                      const void *weight, const float *bias, void *y);

/* Partial sums of columns, [slices][pitch]. */
typedef struct {
    int slices, pitch;
} GpuSlices;
GpuSlices gpu_fused_slices(int rows, int in);

/* to = (d W) slope(y), with slope the derivative of ELU at the layer's input y = elu(..). d
 * [rows][out], weight [out][in], y, to [rows][in]; partial: sums of `to` as gpu_fused_slices
 * says. */
int gpu_fused_backward(cudaStream_t stream, int processors, int rows, int out, int in,
                       const void *d, const void *weight, const void *y, void *to, float *partial);

#ifdef __cplusplus
}
#endif

#endif
