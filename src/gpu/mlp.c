#include "gpu/mlp.h"

#include "gpu/kernels.h"

/* C = op(A) op(B) + beta C, row-major; to cuBLAS, which counts columns first, C^T = op(B)^T
 * op(A)^T. */
static void product(GpuQueue *q, char transpose_a, char transpose_b, int m, int n, int k,
                    const float *a, int lda, const float *b, int ldb, float beta, float *c,
                    int ldc) {
    const float one = 1.0f;
    cublasStatus_t status = cublasSgemm(q->blas, transpose_b == 'T' ? CUBLAS_OP_T : CUBLAS_OP_N,
                                        transpose_a == 'T' ? CUBLAS_OP_T : CUBLAS_OP_N, n, m, k,
                                        &one, b, ldb, a, lda, &beta, c, ldc);
    q->status = q->status ? q->status : status;
}

float *gpu_mlp_forward(GpuQueue *q, const Mlp *mlp, const float *parameters, int rows,
                       const float *x, int ldx, const MlpOutputs *outputs) {
    const int last = mlp->layers - 1;
    for (int l = 0; l <= last; l++) {
        const MlpLayer *layer = &mlp->layer[l];
        product(q, 'N', 'T', rows, layer->out, layer->in, x, ldx, parameters + layer->weight,
                layer->in, 0.0f, outputs->y[l], layer->out);
        gpu_add_bias(q->stream, rows, layer->out, l < last, parameters + layer->bias,
                     outputs->y[l]);
        x = outputs->y[l];
        ldx = layer->out;
    }
    return outputs->y[last];
}

/* Per layer, with d = dL/d(Wx + b):  dW = d^T x,  db = sum over rows of d,  dx = d W. */
void gpu_mlp_backward(GpuQueue *q, const Mlp *mlp, const float *parameters, int rows,
                      const float *x, int ldx, const MlpOutputs *outputs, float *d_last,
                      float *const work[2], float *gradient, float beta, MlpInputGradient input) {
    const int last = mlp->layers - 1;
    float *d = d_last;
    for (int l = last; l >= 0; l--) {
        const MlpLayer *layer = &mlp->layer[l];
        float *next = work[l % 2];
        gpu_bias_backward(q->stream, rows, layer->out, l < last ? outputs->y[l] : NULL, d,
                          q->partial, beta, gradient + layer->bias);
        product(q, 'T', 'N', layer->out, layer->in, rows, d, layer->out,
                l > 0 ? outputs->y[l - 1] : x, l > 0 ? layer->in : ldx, beta,
                gradient + layer->weight, layer->in);
        if (l > 0) {
            product(q, 'N', 'N', rows, layer->in, layer->out, d, layer->out,
                    parameters + layer->weight, layer->in, 0.0f, next, layer->in);
        } else if (input.count > 0) {
            product(q, 'N', 'N', rows, input.count, layer->out, d, layer->out,
                    parameters + layer->weight + input.first, layer->in, 0.0f, input.x,
                    input.count);
        }
        d = next;
    }
}
