#include "learn/cuda/network.h"

#include <string.h>

#include "learn/cuda/fused.h"

static int64_t pad_mlp(const Mlp *from, Mlp *to, int64_t at) {
    to->layers = from->layers;
    for (int l = 0; l < from->layers; l++) {
        MlpLayer *layer = &to->layer[l];
        layer->in = gpu_pitch(from->layer[l].in);
        layer->out = gpu_pitch(from->layer[l].out);
        layer->weight = at;
        layer->bias = at + (int64_t)layer->in * layer->out;
        at = layer->bias + layer->out;
    }
    return at;
}

Network gpu_network(const Network *network) {
    Network padded = *network;
    int64_t at = pad_mlp(&network->encoder, &padded.encoder, 0);
    at = pad_mlp(&network->decoder, &padded.decoder, at);
    at = pad_mlp(&network->modulation, &padded.modulation, at);
    at = pad_mlp(&network->actor, &padded.actor, at);
    padded.critic_first = at;
    padded.log_std = pad_mlp(&network->critic, &padded.critic, at);
    padded.count = padded.log_std + gpu_pitch(network->def.actions);
    padded.history = gpu_pitch(network->history);
    padded.heads = gpu_pitch(network->heads);
    padded.theta = gpu_pitch(network->theta);
    padded.actor_input = gpu_pitch(network->actor_input);
    padded.decoder_input = gpu_pitch(network->decoder_input);
    return padded;
}

static void copy(float *to, const float *from, int count) {
    memcpy(to, from, (size_t)count * sizeof *to);
}

/* Copies all parameters, from the padded array or to it. */
static void copy_all(const Network *network, const Network *padded, const float *from, float *to,
                     int pad) {
    for (int i = 0; i < NETWORK_MLPS; i++) {
        const char *name;
        const Mlp *mlp = network_mlp(network, i, &name), *wide = network_mlp(padded, i, &name);
        for (int l = 0; l < mlp->layers; l++) {
            const MlpLayer *a = &mlp->layer[l], *b = &wide->layer[l];
            for (int row = 0; row < a->out; row++) {
                const int64_t tight = a->weight + (int64_t)row * a->in,
                              loose = b->weight + (int64_t)row * b->in;
                copy(to + (pad ? loose : tight), from + (pad ? tight : loose), a->in);
            }
            copy(to + (pad ? b->bias : a->bias), from + (pad ? a->bias : b->bias), a->out);
        }
    }
    copy(to + (pad ? padded : network)->log_std, from + (pad ? network : padded)->log_std,
         network->def.actions);
}

void gpu_network_pad(const Network *network, const Network *padded, const float *from, float *to) {
    memset(to, 0, (size_t)padded->count * sizeof *to);
    copy_all(network, padded, from, to, 1);
}

void gpu_network_strip(const Network *network, const Network *padded, const float *from,
                       float *to) {
    copy_all(network, padded, from, to, 0);
}

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

/* Of a fused product: whether it was enqueued. */
static void fused_status(GpuQueue *q, int ok) {
    if (!ok && !q->status) {
        q->status = CUBLAS_STATUS_EXECUTION_FAILED;
    }
}

static GpuArray weight_of(const GpuQueue *q, const MlpLayer *layer) {
    return gpu_array_from(q->weights, (size_t)layer->weight);
}

/* y = elu(x W^T + b), of a last layer x W^T + b. */
static void layer_forward(GpuQueue *q, const MlpLayer *layer, const float *parameters,
                          int is_hidden, int rows, GpuArray x, GpuArray y) {
    const GpuArray weight = weight_of(q, layer);
    const float *bias = parameters + layer->bias;
    if (q->fused && is_hidden) {
        fused_status(q, gpu_fused_forward(q->stream, q->fused, rows, layer->out, layer->in, x.at,
                                          weight.at, bias, y.at));
        return;
    }
    product(q, 'N', 'T', rows, layer->out, layer->in, x, layer->in, weight, layer->in, 0.0f, y,
            layer->out);
    gpu_add_bias(q->stream, rows, layer->out, is_hidden, bias, y);
}

float *gpu_mlp_forward(GpuQueue *q, const Mlp *mlp, const float *parameters, int rows, GpuArray x,
                       const GpuOutputs *outputs) {
    const int last = mlp->layers - 1;
    for (int l = 0; l <= last; l++) {
        layer_forward(q, &mlp->layer[l], parameters, l < last, rows, x, outputs->y[l]);
        x = outputs->y[l];
    }
    return outputs->y[last].at;
}

static int64_t columns_end(const GpuColumns *columns) {
    if (columns->count == 0) {
        return 0;
    }
    const GpuColumnSum *last = &columns->sum[columns->count - 1];
    return last->partial + (int64_t)last->slices * last->pitch;
}

float *gpu_columns_next(GpuQueue *q) {
    return q->partial + columns_end(&q->columns);
}

void gpu_columns_add(GpuQueue *q, int width, int slices, int pitch, int64_t at) {
    GpuColumns *columns = &q->columns;
    const GpuColumnSum sum = {width, slices, pitch, columns_end(columns), at};
    columns->sum[columns->count++] = sum;
}

int64_t gpu_mlp_partial(const Mlp *mlp, int fused, int rows) {
    int64_t most = 0;
    for (int l = 0; l < mlp->layers; l++) {
        const int width = mlp->layer[l].out;
        int64_t own = (int64_t)GPU_SUM_SLICES * width;
        if (fused) {
            const GpuSlices s = gpu_fused_slices(rows, width);
            const int64_t other = (int64_t)s.slices * s.pitch;
            own = other > own ? other : own;
        }
        most += own;
    }
    return most;
}

/* to = d slope(y), and the sums of the bias. */
static void end_backward(GpuQueue *q, const MlpLayer *layer, int rows, GpuArray y, GpuArray d,
                         GpuArray to) {
    const int slices =
        gpu_bias_backward(q->stream, rows, layer->out, y, d, to, gpu_columns_next(q));
    gpu_columns_add(q, layer->out, slices, layer->out, layer->bias);
}

/* to = (d W) slope(y), with y the layer's input, the output of the layer before, and the sums of
 * the latter's bias. */
static void layer_backward(GpuQueue *q, const MlpLayer *layer, const MlpLayer *before, int rows,
                           GpuArray d, GpuArray y, GpuArray to) {
    const GpuArray weight = weight_of(q, layer);
    if (q->fused) {
        const GpuSlices s = gpu_fused_slices(rows, layer->in);
        fused_status(q, gpu_fused_backward(q->stream, q->fused, rows, layer->out, layer->in, d.at,
                                           weight.at, y.at, to.at, gpu_columns_next(q)));
        gpu_columns_add(q, layer->in, s.slices, s.pitch, before->bias);
        return;
    }
    product(q, 'N', 'N', rows, layer->in, layer->out, d, layer->out, weight, layer->in, 0.0f, to,
            layer->in);
    end_backward(q, before, rows, y, to, to);
}

/* Per layer, with d = dL/d(Wx + b):  dW = d^T x,  db = sum over rows of d,  dx = d W. */
void gpu_mlp_backward(GpuQueue *q, const Mlp *mlp, int rows, GpuArray x, const GpuOutputs *outputs,
                      float *d_last, const GpuArray work[2], float *gradient, float beta,
                      float *d_x) {
    const int last = mlp->layers - 1;
    const GpuArray linear = {NULL, x.bf16};
    GpuArray d = gpu_array_float(d_last), to = x.bf16 ? work[(last + 1) % 2] : d;
    end_backward(q, &mlp->layer[last], rows, linear, d, to);
    for (int l = last; l >= 0; l--) {
        const MlpLayer *layer = &mlp->layer[l];
        d = to;
        product(q, 'T', 'N', layer->out, layer->in, rows, d, layer->out,
                l > 0 ? outputs->y[l - 1] : x, layer->in, beta,
                gpu_array_float(gradient + layer->weight), layer->in);
        if (l > 0) {
            to = work[l % 2];
            layer_backward(q, layer, layer - 1, rows, d, outputs->y[l - 1], to);
        } else if (d_x) {
            product(q, 'N', 'N', rows, layer->in, layer->out, d, layer->out, weight_of(q, layer),
                    layer->in, 0.0f, gpu_array_float(d_x), layer->in);
        }
    }
}
