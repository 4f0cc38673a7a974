/* Networks on the GPU: mlp.c of src/learn over device arrays with padded widths
 * (cuda/network.h). */
#ifndef MILD_GPU_MLP_H
#define MILD_GPU_MLP_H

#include <cublas_v2.h>

#include "learn/mlp.h"

typedef struct {
    cudaStream_t stream;
    cublasHandle_t blas;
    cublasComputeType_t arithmetic; /* of the products */
    cublasStatus_t status;          /* the first failure of a product */
    float *partial;                 /* [GPU_SUM_SLICES][widest layer] of the column sums */
} GpuQueue;

/* As mlp_forward and mlp_backward, with rows of the first layer's width in x. They only enqueue.
 * Failures show in status and when the stream is waited for. The outputs' arrays are aligned to 16
 * bytes. */
float *gpu_mlp_forward(GpuQueue *queue, const Mlp *mlp, const float *parameters, int rows,
                       const float *x, const MlpOutputs *outputs);
/* d_x: gradient with respect to the input; NULL: not computed. */
void gpu_mlp_backward(GpuQueue *queue, const Mlp *mlp, const float *parameters, int rows,
                      const float *x, const MlpOutputs *outputs, float *d_last,
                      float *const work[2], float *gradient, float beta, float *d_x);

#endif
