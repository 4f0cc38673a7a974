#include "learn/mlp.h"

#include <math.h>

#include "base/random.h"
#include "learn/product.h"
#include "learn/vector.h"

int64_t mlp_layout(Mlp *mlp, int in, const int *hidden, int out, int64_t offset) {
    int count = 0;
    while (count < POLICY_LAYERS_MAX && hidden[count] > 0) {
        count++;
    }
    mlp->layers = count + 1;
    mlp->activation = MLP_ELU;
    for (int l = 0; l <= count; l++) {
        MlpLayer *layer = &mlp->layer[l];
        layer->in = l == 0 ? in : hidden[l - 1];
        layer->out = l == count ? out : hidden[l];
        layer->weight = offset;
        layer->bias = offset + (int64_t)layer->in * layer->out;
        offset = layer->bias + layer->out;
    }
    return offset;
}

int mlp_widest(const Mlp *mlp) {
    int widest = 0;
    for (int l = 0; l < mlp->layers; l++) {
        widest = mlp->layer[l].out > widest ? mlp->layer[l].out : widest;
    }
    return widest;
}

void mlp_initialise(const Mlp *mlp, float *parameters, uint64_t seed, uint32_t stream,
                    double last_scale) {
    for (int l = 0; l < mlp->layers; l++) {
        const MlpLayer *layer = &mlp->layer[l];
        Random random = random_at(seed, stream, (uint32_t)l);
        double scale = (l == mlp->layers - 1 ? last_scale : 1.0) / sqrt((double)layer->in);
        for (int64_t i = layer->weight; i < layer->bias; i++) {
            parameters[i] = (float)(scale * random_normal(&random));
        }
        for (int i = 0; i < layer->out; i++) {
            parameters[layer->bias + i] = 0.0f;
        }
    }
}

float *mlp_carve(float *block, size_t *used, size_t count) {
    float *taken = block ? block + *used : NULL;
    *used += (count + 15) / 16 * 16;
    return taken;
}

void mlp_carve_outputs(const Mlp *mlp, int rows, float *block, size_t *used, MlpOutputs *outputs) {
    for (int l = 0; l < mlp->layers; l++) {
        outputs->y[l] = mlp_carve(block, used, (size_t)rows * (size_t)mlp->layer[l].out);
    }
}

static void add_bias(int rows, int width, const float *restrict bias, float *restrict y) {
    for (int r = 0; r < rows; r++, y += width) {
#pragma omp simd
        for (int j = 0; j < width; j++) {
            y[j] += bias[j];
        }
    }
}

static void add_bias_elu(int rows, int width, const float *restrict bias, float *restrict y) {
    for (int r = 0; r < rows; r++, y += width) {
#pragma omp simd
        for (int j = 0; j < width; j++) {
            y[j] = vector_elu(y[j] + bias[j]);
        }
    }
}

static void add_bias_softsign(int rows, int width, const float *restrict bias, float *restrict y) {
    for (int r = 0; r < rows; r++, y += width) {
#pragma omp simd
        for (int j = 0; j < width; j++) {
            y[j] = vector_softsign(y[j] + bias[j]);
        }
    }
}

/* d *= slope(y), and the bias' gradient += the column sums of d. */
static void elu_backward(int rows, int width, const float *restrict y, float *restrict d,
                         float *restrict d_bias) {
    for (int r = 0; r < rows; r++, y += width, d += width) {
#pragma omp simd
        for (int j = 0; j < width; j++) {
            d[j] *= vector_elu_slope(y[j]);
            d_bias[j] += d[j];
        }
    }
}

static void softsign_backward(int rows, int width, const float *restrict y, float *restrict d,
                              float *restrict d_bias) {
    for (int r = 0; r < rows; r++, y += width, d += width) {
#pragma omp simd
        for (int j = 0; j < width; j++) {
            d[j] *= vector_softsign_slope(y[j]);
            d_bias[j] += d[j];
        }
    }
}

static void bias_backward(int rows, int width, const float *restrict d, float *restrict d_bias) {
    for (int r = 0; r < rows; r++, d += width) {
#pragma omp simd
        for (int j = 0; j < width; j++) {
            d_bias[j] += d[j];
        }
    }
}

float *mlp_forward(const Mlp *mlp, const float *parameters, int rows, const float *x, int ldx,
                   const MlpOutputs *outputs) {
    int last = mlp->layers - 1;
    for (int l = 0; l <= last; l++) {
        const MlpLayer *layer = &mlp->layer[l];
        product('N', 'T', rows, layer->out, layer->in, x, ldx, parameters + layer->weight,
                layer->in, 0.0f, outputs->y[l], layer->out);
        if (l == last) {
            add_bias(rows, layer->out, parameters + layer->bias, outputs->y[l]);
        } else {
            (mlp->activation == MLP_SOFTSIGN ? add_bias_softsign : add_bias_elu)(
                rows, layer->out, parameters + layer->bias, outputs->y[l]);
        }
        x = outputs->y[l];
        ldx = layer->out;
    }
    return outputs->y[last];
}

/* Per layer, with d = dL/d(Wx + b):  dW = d^T x,  db = sum over rows of d,  dx = d W. */
void mlp_backward(const Mlp *mlp, const float *parameters, int rows, const float *x, int ldx,
                  const MlpOutputs *outputs, const float *d_last, float *const work[2],
                  float *gradient, float beta, MlpInputGradient input) {
    const float *d = d_last;
    for (int l = mlp->layers - 1; l >= 0; l--) {
        const MlpLayer *layer = &mlp->layer[l];
        const float *below = l > 0 ? outputs->y[l - 1] : x;
        int ld = l > 0 ? layer->in : ldx;
        product('T', 'N', layer->out, layer->in, rows, d, layer->out, below, ld, beta,
                gradient + layer->weight, layer->in);
        float *next = work[l % 2];
        if (l > 0) {
            product('N', 'N', rows, layer->in, layer->out, d, layer->out,
                    parameters + layer->weight, layer->in, 0.0f, next, layer->in);
        } else if (input.count > 0) {
            product('N', 'N', rows, input.count, layer->out, d, layer->out,
                    parameters + layer->weight + input.first, layer->in, 0.0f, input.x,
                    input.count);
        }
        if (l == mlp->layers - 1) {
            for (int j = 0; j < layer->out && beta == 0.0f; j++) {
                gradient[layer->bias + j] = 0.0f;
            }
            bias_backward(rows, layer->out, d, gradient + layer->bias);
        }
        if (l > 0) {
            float *d_bias = gradient + mlp->layer[l - 1].bias;
            for (int j = 0; j < layer->in && beta == 0.0f; j++) {
                d_bias[j] = 0.0f;
            }
            (mlp->activation == MLP_SOFTSIGN ? softsign_backward : elu_backward)(
                rows, layer->in, outputs->y[l - 1], next, d_bias);
        }
        d = next;
    }
}
