#include "learn/cuda/mlp.h"

#include "learn/cuda/kernels.h"

/* C = op(A) op(B) + beta C, row-major; to cuBLAS, which counts columns first, C^T = op(B)^T
 * op(A)^T. */
static void product(GpuQueue *q, char transpose_a, char transpose_b, int m, int n, int k,
                    const float *a, int lda, const float *b, int ldb, float beta, float *c,
                    int ldc) {
    const float one = 1.0f;
    cublasStatus_t status = cublasGemmEx(q->blas, transpose_b == 'T' ? CUBLAS_OP_T : CUBLAS_OP_N,
                                         transpose_a == 'T' ? CUBLAS_OP_T : CUBLAS_OP_N, n, m, k,
                                         &one, b, CUDA_R_32F, ldb, a, CUDA_R_32F, lda, &beta, c,
                                         CUDA_R_32F, ldc, q->arithmetic, CUBLAS_GEMM_DEFAULT);
    q->status = q->status ? q->status : status;
}

float *gpu_mlp_forward(GpuQueue *q, const Mlp *mlp, const float *parameters, int rows,
                       const float *x, const MlpOutputs *outputs) {
    const int last = mlp->layers - 1;
    for (int l = 0; l <= last; l++) {
        const MlpLayer *layer = &mlp->layer[l];
        float *y = outputs->y[l];
        product(q, 'N', 'T', rows, layer->out, layer->in, x, layer->in, parameters + layer->weight,
                layer->in, 0.0f, y, layer->out);
        gpu_add_bias(q->stream, rows, layer->out, l < last, parameters + layer->bias, y);
        x = y;
    }
    return outputs->y[last];
}

/* Per layer, with d = dL/d(Wx + b):  dW = d^T x,  db = sum over rows of d,  dx = d W. */
void gpu_mlp_backward(GpuQueue *q, const Mlp *mlp, const float *parameters, int rows,
                      const float *x, const MlpOutputs *outputs, float *d_last,
                      float *const work[2], float *gradient, float beta, float *d_x) {
    const int last = mlp->layers - 1;
    float *d = d_last;
    for (int l = last; l >= 0; l--) {
        const MlpLayer *layer = &mlp->layer[l];
        float *next = l > 0 ? work[l % 2] : d_x;
        gpu_bias_backward(q->stream, rows, layer->out, l < last ? outputs->y[l] : NULL, d,
                          q->partial, beta, gradient + layer->bias);
        product(q, 'T', 'N', layer->out, layer->in, rows, d, layer->out,
                l > 0 ? outputs->y[l - 1] : x, layer->in, beta, gradient + layer->weight,
                layer->in);
        if (next) {
            product(q, 'N', 'N', rows, layer->in, layer->out, d, layer->out,
                    parameters + layer->weight, layer->in, 0.0f, next, layer->in);
        }
        d = next;
    }
}
