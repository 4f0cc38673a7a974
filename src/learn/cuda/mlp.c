#include "learn/cuda/mlp.h"

static cudaDataType_t type_of(GpuArray array) {
    return array.bf16 ? CUDA_R_16BF : CUDA_R_32F;
}

/* C = op(A) op(B) + beta C, row-major; to cuBLAS, which counts columns first, C^T = op(B)^T
 * op(A)^T. */
static void product(GpuQueue *q, char transpose_a, char transpose_b, int m, int n, int k,
                    GpuArray a, int lda, GpuArray b, int ldb, float beta, GpuArray c, int ldc) {
    const float one = 1.0f;
    cublasStatus_t status = cublasGemmEx(q->blas, transpose_b == 'T' ? CUBLAS_OP_T : CUBLAS_OP_N,
                                         transpose_a == 'T' ? CUBLAS_OP_T : CUBLAS_OP_N, n, m, k,
                                         &one, b.at, type_of(b), ldb, a.at, type_of(a), lda, &beta,
                                         c.at, type_of(c), ldc, q->arithmetic, CUBLAS_GEMM_DEFAULT);
    q->status = q->status ? q->status : status;
}

static GpuArray weight_of(const GpuQueue *q, const MlpLayer *layer) {
    return gpu_array_from(q->weights, (size_t)layer->weight);
}

float *gpu_mlp_forward(GpuQueue *q, const Mlp *mlp, const float *parameters, int rows, GpuArray x,
                       const GpuOutputs *outputs) {
    const int last = mlp->layers - 1;
    for (int l = 0; l <= last; l++) {
        const MlpLayer *layer = &mlp->layer[l];
        const GpuArray y = outputs->y[l];
        product(q, 'N', 'T', rows, layer->out, layer->in, x, layer->in, weight_of(q, layer),
                layer->in, 0.0f, y, layer->out);
        gpu_add_bias(q->stream, rows, layer->out, l < last, parameters + layer->bias, y);
        x = y;
    }
    return outputs->y[last].at;
}

static int64_t columns_end(const GpuColumns *columns) {
    const GpuColumnSum *last = &columns->sum[columns->count - 1];
    return columns->count > 0 ? last->partial + (int64_t)last->slices * last->width : 0;
}

float *gpu_columns_next(GpuQueue *q) {
    return q->partial + columns_end(&q->columns);
}

void gpu_columns_add(GpuQueue *q, int width, int slices, int64_t at) {
    GpuColumns *columns = &q->columns;
    const GpuColumnSum sum = {width, slices, columns_end(columns), at};
    columns->sum[columns->count++] = sum;
}

/* Per layer, with d = dL/d(Wx + b):  dW = d^T x,  db = sum over rows of d,  dx = d W. */
void gpu_mlp_backward(GpuQueue *q, const Mlp *mlp, int rows, GpuArray x, const GpuOutputs *outputs,
                      float *d_last, const GpuArray work[2], float *gradient, float beta,
                      float *d_x) {
    const int last = mlp->layers - 1;
    GpuArray d = gpu_array_float(d_last), to = x.bf16 ? work[(last + 1) % 2] : d;
    for (int l = last; l >= 0; l--) {
        const MlpLayer *layer = &mlp->layer[l];
        const GpuArray linear = {NULL, x.bf16}, next = l > 0 ? work[l % 2] : gpu_array_float(d_x);
        const int slices =
            gpu_bias_backward(q->stream, rows, layer->out, l < last ? outputs->y[l] : linear, d, to,
                              gpu_columns_next(q));
        gpu_columns_add(q, layer->out, slices, layer->bias);
        product(q, 'T', 'N', layer->out, layer->in, rows, to, layer->out,
                l > 0 ? outputs->y[l - 1] : x, layer->in, beta,
                gpu_array_float(gradient + layer->weight), layer->in);
        if (next.at) {
            product(q, 'N', 'N', rows, layer->in, layer->out, to, layer->out, weight_of(q, layer),
                    layer->in, 0.0f, next, layer->in);
        }
        d = to = next;
    }
}
