#include "gpu/kernels.h"

#include "learn/loss_sample.h"
#include "learn/noise.h"

#define THREADS 256
#define COLUMNS 32 /* of a block in the column sums */
#define LANES (THREADS / COLUMNS)

#ifndef LAUNCH /* the tests run the kernels on the processor */
#define LAUNCH(kernel, grid, block, stream, ...) kernel<<<grid, block, 0, stream>>>(__VA_ARGS__)
#endif

static const dim3 line = {THREADS, 1, 1}; /* of threads: the block of every kernel but one */

static dim3 blocks_of(int64_t items) {
    return {items > 0 ? (unsigned)((items + THREADS - 1) / THREADS) : 1u, 1, 1};
}

int gpu_blocks(int rows) {
    return (int)blocks_of(rows).x;
}

static __device__ int64_t item() {
    return (int64_t)blockIdx.x * THREADS + threadIdx.x;
}

/* Adds the block's sum of x to *to; every thread of the block calls. */
static __device__ void add_block_sum(double x, double *to) {
    __shared__ double part[THREADS];
    part[threadIdx.x] = x;
    for (unsigned half = THREADS / 2; half > 0; half /= 2) {
        __syncthreads();
        if (threadIdx.x < half) {
            part[threadIdx.x] += part[threadIdx.x + half];
        }
    }
    if (threadIdx.x == 0) {
        *to += part[0];
    }
    __syncthreads();
}

/* ---- rows ---- */

static __global__ void gather(int64_t count, int width, const int *index, const float *from,
                              float *to) {
    int64_t i = item();
    if (i < count) {
        to[i] = from[(int64_t)index[i / width] * width + i % width];
    }
}

void gpu_gather(cudaStream_t stream, int rows, int width, const int *index, const float *from,
                float *to) {
    int64_t count = (int64_t)rows * width;
    LAUNCH(gather, blocks_of(count), line, stream, count, width, index, from, to);
}

static __global__ void mirror_history(GpuImages m, const float *history, float *to) {
    int64_t i = item();
    const int width = m.frames * m.observation;
    if (i >= (int64_t)m.images * width) {
        return;
    }
    int image = (int)(i / width), column = (int)(i % width), k = column % m.observation;
    const float *row = history + (int64_t)(m.which[image] - m.first) * width;
    to[i] = m.sign[k] * row[column - k + m.index[k]];
}

void gpu_mirror_history(cudaStream_t stream, GpuImages m, const float *history, float *to) {
    LAUNCH(mirror_history, blocks_of((int64_t)m.images * m.frames * m.observation), line, stream, m,
           history, to);
}

static __global__ void latent_noise(int64_t count, int latent, uint32_t key0, uint32_t key1,
                                    const int *row, float *noise) {
    int64_t i = item();
    if (i >= count) {
        return;
    }
    int64_t number = (int64_t)row[i / latent] * latent + i % latent;
    float even, odd;
    noise_pair(key0, key1, (uint32_t)(number / 2), &even, &odd);
    noise[i] = number % 2 ? odd : even;
}

void gpu_latent_noise(cudaStream_t stream, int rows, int latent, uint64_t key, const int *row,
                      float *noise) {
    int64_t count = (int64_t)rows * latent;
    LAUNCH(latent_noise, blocks_of(count), line, stream, count, latent, (uint32_t)key,
           (uint32_t)(key >> 32), row, noise);
}

/* ---- layers ---- */

static __global__ void add_bias(int64_t count, int width, int elu, const float *bias, float *y) {
    int64_t i = item();
    if (i >= count) {
        return;
    }
    float x = y[i] + bias[i % width];
    y[i] = elu ? vector_elu(x) : x;
}

void gpu_add_bias(cudaStream_t stream, int rows, int width, int elu, const float *bias, float *y) {
    int64_t count = (int64_t)rows * width;
    LAUNCH(add_bias, blocks_of(count), line, stream, count, width, elu, bias, y);
}

/* Block (column group, slice of rows): LANES partial sums a column, added in order. */
static __global__ void bias_backward(int rows, int width, const float *y, float *d,
                                     float *partial) {
    __shared__ float part[LANES][COLUMNS];
    const int column = (int)(blockIdx.x * COLUMNS + threadIdx.x), slice = (int)blockIdx.y;
    const int end = (int)((int64_t)rows * (slice + 1) / GPU_SUM_SLICES);
    float sum = 0.0f;
    for (int r = (int)((int64_t)rows * slice / GPU_SUM_SLICES) + (int)threadIdx.y;
         column < width && r < end; r += LANES) {
        int64_t i = (int64_t)r * width + column;
        float x = d[i];
        if (y) {
            x *= vector_elu_slope(y[i]);
            d[i] = x;
        }
        sum += x;
    }
    part[threadIdx.y][threadIdx.x] = sum;
    __syncthreads();
    if (threadIdx.y > 0 || column >= width) {
        return;
    }
    for (int lane = 1; lane < LANES; lane++) {
        sum += part[lane][threadIdx.x];
    }
    partial[slice * width + column] = sum;
}

static __global__ void add_slices(int width, const float *partial, float beta, float *sum) {
    int column = (int)item();
    if (column >= width) {
        return;
    }
    float total = 0.0f;
    for (int slice = 0; slice < GPU_SUM_SLICES; slice++) {
        total += partial[slice * width + column];
    }
    sum[column] = beta == 0.0f ? total : sum[column] + total;
}

void gpu_bias_backward(cudaStream_t stream, int rows, int width, const float *y, float *d,
                       float *partial, float beta, float *d_bias) {
    const dim3 grid = {(unsigned)((width + COLUMNS - 1) / COLUMNS), GPU_SUM_SLICES, 1},
               block = {COLUMNS, LANES, 1};
    LAUNCH(bias_backward, grid, block, stream, rows, width, y, d, partial);
    LAUNCH(add_slices, blocks_of(width), line, stream, width, partial, beta, d_bias);
}

/* ---- rows between the networks ---- */

/* One thread a number of the input [newest frame | estimates | theta1 mu + theta2]. */
static __global__ void actor_input(GpuWidths w, int rows, const float *history, const float *heads,
                                   const float *theta, float *input) {
    int64_t i = item();
    const int width = w.observation + w.estimates + w.latent;
    if (i >= (int64_t)rows * width) {
        return;
    }
    const int64_t r = i / width;
    const int column = (int)(i % width), head = column - w.observation, j = head - w.estimates;
    const float *h = heads + r * (w.estimates + 2 * w.latent);
    if (head < 0) {
        input[i] = history[(r + 1) * w.history - w.observation + column];
    } else if (j < 0) {
        input[i] = h[head];
    } else {
        const float *t = theta + r * (w.per_dimension ? 2 * w.latent : 2);
        input[i] = t[w.per_dimension ? j : 0] * h[head] + t[w.per_dimension ? w.latent + j : 1];
    }
}

void gpu_actor_input(cudaStream_t stream, GpuWidths w, int rows, const float *history,
                     const float *heads, const float *theta, float *input) {
    LAUNCH(actor_input, blocks_of((int64_t)rows * (w.observation + w.estimates + w.latent)), line,
           stream, w, rows, history, heads, theta, input);
}

/* One thread a number of the decoder's input [z | estimates]. */
static __global__ void sample_latent(GpuWidths w, int rows, const float *heads, const float *noise,
                                     float *spread, float *input) {
    int64_t i = item();
    const int width = w.latent + w.estimates;
    if (i >= (int64_t)rows * width) {
        return;
    }
    const int64_t r = i / width;
    const int j = (int)(i % width);
    const float *h = heads + r * (w.estimates + 2 * w.latent);
    if (j >= w.latent) {
        input[i] = h[j - w.latent];
        return;
    }
    const float *mu = h + w.estimates;
    float s = loss_spread(mu[w.latent + j]);
    spread[r * w.latent + j] = s;
    input[i] = mu[j] + s * noise[r * w.latent + j];
}

void gpu_sample_latent(cudaStream_t stream, GpuWidths w, int rows, const float *heads,
                       const float *noise, float *spread, float *input) {
    LAUNCH(sample_latent, blocks_of((int64_t)rows * (w.latent + w.estimates)), line, stream, w,
           rows, heads, noise, spread, input);
}

/* ---- losses: one thread a sample ---- */

static __global__ void surrogate(GpuSurrogate s, int rows, double *sums) {
    const int64_t r = item();
    double loss = 0.0, divergence = 0.0, clipped = 0.0;
    if (r < rows) {
        const int actions = s.actions;
        const float *action = s.action + r * actions, *mean = s.mean + r * actions;
        const LossSurrogate sample =
            loss_surrogate(actions, s.constant, s.clip, action, mean, s.old_mean + r * actions,
                           s.old_log_prob[r], s.advantage[r]);
        const float d_log_prob = sample.d_log_prob * s.weight;
        for (int j = 0; j < actions; j++) {
            const float t = loss_standard(action[j], mean[j], s.constant[j]);
            s.d_mean[r * actions + j] = loss_mean_gradient(d_log_prob, t, s.constant[j]);
            s.d_log_std[r * actions + j] = loss_log_std_gradient(d_log_prob, t) - s.entropy;
        }
        loss = sample.loss;
        clipped = sample.clipped;
        divergence = sample.kl;
    }
    double *own = sums + (int64_t)blockIdx.x * GPU_SUMS;
    add_block_sum(loss, own + GPU_SUM_SURROGATE);
    add_block_sum(divergence, own + GPU_SUM_KL);
    add_block_sum(clipped, own + GPU_SUM_CLIPPED);
}

void gpu_surrogate(cudaStream_t stream, GpuSurrogate s, int rows, double *sums) {
    LAUNCH(surrogate, blocks_of(rows), line, stream, s, rows, sums);
}

/* A sample has at most one image: no two threads write one row. action_index is a permutation. */
static __global__ void mirror_loss(GpuMirror m, int images, double *sums) {
    const int64_t r = item();
    float sum = 0.0f;
    if (r < images) {
        const int64_t sample = m.which[r] - m.first;
        sum = loss_mirror(m.actions, m.index, m.sign, m.weight, m.mean + sample * m.actions,
                          m.image + r * m.actions, m.d_mean + sample * m.actions,
                          m.d_image + r * m.actions);
    }
    add_block_sum((double)sum / m.actions, sums + (int64_t)blockIdx.x * GPU_SUMS + GPU_SUM_MIRROR);
}

void gpu_mirror_loss(cudaStream_t stream, GpuMirror m, int images, double *sums) {
    LAUNCH(mirror_loss, blocks_of(images), line, stream, m, images, sums);
}

static __global__ void reconstruction(int rows, int width, float weight, const float *decoded,
                                      const float *target, float *d, double *sums) {
    const int64_t r = item();
    float sum = 0.0f;
    for (int64_t i = r * width; r < rows && i < (r + 1) * width; i++) {
        float gap = decoded[i] - target[i];
        sum += gap * gap;
        d[i] = weight * gap;
    }
    add_block_sum((double)sum / width,
                  sums + (int64_t)blockIdx.x * GPU_SUMS + GPU_SUM_RECONSTRUCTION);
}

void gpu_reconstruction(cudaStream_t stream, int rows, int width, float weight,
                        const float *decoded, const float *target, float *d, double *sums) {
    LAUNCH(reconstruction, blocks_of(rows), line, stream, rows, width, weight, decoded, target, d,
           sums);
}

static __global__ void modulation_backward(GpuWidths w, int rows, const float *heads,
                                           const float *theta, const float *d_input, float *d_heads,
                                           float *d_theta) {
    const int64_t r = item();
    if (r >= rows) {
        return;
    }
    const int width = w.estimates + 2 * w.latent, theta_width = w.per_dimension ? 2 * w.latent : 2;
    loss_modulation(w.estimates, w.latent, w.per_dimension, heads + r * width,
                    theta + r * theta_width, d_input + r * (w.estimates + w.latent),
                    d_heads + r * width, d_theta + r * theta_width);
}

void gpu_modulation_backward(cudaStream_t stream, GpuWidths w, int rows, const float *heads,
                             const float *theta, const float *d_input, float *d_heads,
                             float *d_theta) {
    LAUNCH(modulation_backward, blocks_of(rows), line, stream, w, rows, heads, theta, d_input,
           d_heads, d_theta);
}

static __device__ double latent_row(int latent, float weight, const float *mu, const float *spread,
                                    const float *noise, const float *d_z, float *d_mu) {
    const float *logvar = mu + latent;
    float *d_logvar = d_mu + latent, twice = 0.0f;
    for (int j = 0; j < latent; j++) {
        twice += loss_latent_twice(mu[j], logvar[j], spread[j]);
        d_mu[j] += loss_mu_gradient(weight, mu[j], d_z[j]);
        d_logvar[j] = loss_logvar_gradient(weight, logvar[j], spread[j], noise[j], d_z[j]);
    }
    return 0.5 * (double)twice;
}

static __global__ void heads_backward(GpuWidths w, GpuHeads h, int rows, int all, double *sums) {
    const int64_t r = item();
    const int width = w.estimates + 2 * w.latent, feet_end = w.feet_offset + w.feet_count;
    double group[3] = {0.0, 0.0, 0.0}, divergence = 0.0;
    float *d = h.d_heads + r * width;
    for (int j = 0; r < all && j < w.feet_count; j++) {
        d[w.feet_offset + j] += h.d_feet[r * w.feet_count + j];
    }
    if (r < rows) {
        const float *heads = h.heads + r * width, *target = h.estimate + r * w.estimates;
        const float *d_input = h.d_decoder_input + r * (w.latent + w.estimates);
        for (int j = 0; j < w.estimates; j++) {
            d[j] += d_input[w.latent + j];
        }
        group[0] = loss_estimates(0, w.feet_offset, h.estimate_weight, heads, target, d);
        group[1] = loss_estimates(w.feet_offset, feet_end, h.estimate_weight, heads, target, d);
        group[2] = loss_estimates(feet_end, w.estimates, h.estimate_weight, heads, target, d);
        divergence =
            latent_row(w.latent, h.latent_weight, heads + w.estimates, h.spread + r * w.latent,
                       h.noise + r * w.latent, d_input, d + w.estimates);
    }
    double *own = sums + (int64_t)blockIdx.x * GPU_SUMS;
    for (int g = 0; g < 3; g++) {
        add_block_sum(group[g], own + GPU_SUM_ESTIMATE + g);
    }
    add_block_sum(divergence, own + GPU_SUM_VAE_KL);
}

void gpu_heads_backward(cudaStream_t stream, GpuWidths w, GpuHeads h, int rows, int all,
                        double *sums) {
    LAUNCH(heads_backward, blocks_of(all), line, stream, w, h, rows, all, sums);
}

static __global__ void value_loss(int rows, int clip_value, float clip, float weight,
                                  const float *value, const float *returns, const float *old_value,
                                  float *d, double *sums) {
    const int64_t r = item();
    double loss = 0.0;
    if (r < rows) {
        float half;
        const float gap = loss_value(clip_value, clip, value[r], old_value[r], returns[r], &half);
        loss = (double)gap * gap;
        d[r] = weight * half;
    }
    add_block_sum(loss, sums + (int64_t)blockIdx.x * GPU_SUMS + GPU_SUM_VALUE);
}

void gpu_value_loss(cudaStream_t stream, int rows, int clip_value, float clip, float weight,
                    const float *value, const float *returns, const float *old_value, float *d,
                    double *sums) {
    LAUNCH(value_loss, blocks_of(rows), line, stream, rows, clip_value, clip, weight, value,
           returns, old_value, d, sums);
}
