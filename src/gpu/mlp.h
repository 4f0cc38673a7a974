/* Networks on the GPU: mlp.c of src/learn over device arrays. */
#ifndef MILD_GPU_MLP_H
#define MILD_GPU_MLP_H

#include <cublas_v2.h>

#include "learn/mlp.h"

typedef struct {
    cudaStream_t stream;
    cublasHandle_t blas;
    cublasStatus_t status; /* the first failure of a product */
    float *partial;        /* [GPU_SUM_SLICES][widest layer] of the column sums */
} GpuQueue;

/* As mlp_forward and mlp_backward. They only enqueue. Failures show in status and when the stream
 * is waited for. */
float *gpu_mlp_forward(GpuQueue *queue, const Mlp *mlp, const float *parameters, int rows,
                       const float *x, int ldx, const MlpOutputs *outputs);
void gpu_mlp_backward(GpuQueue *queue, const Mlp *mlp, const float *parameters, int rows,
                      const float *x, int ldx, const MlpOutputs *outputs, float *d_last,
                      float *const work[2], float *gradient, float beta, MlpInputGradient input);

#endif
