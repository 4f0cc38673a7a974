#include "learn/cuda/kernels.h"

#include "learn/cuda/launch.h"
#include "learn/loss_sample.h"
#include "learn/noise.h"

#define COLUMNS 32 /* of a block in the column sums */
#define LANES (THREADS / COLUMNS)
#define SLICE_ROWS (8 * LANES) /* of a slice, at least */

int gpu_blocks(int rows) {
    return (int)blocks_of(rows).x;
}

/* Adds the block's sum of x to *to; every thread of the block calls. */
static __device__ void add_block_sum(double x, double *to) {
    const double sum = block_sum(x);
    if (threadIdx.x == 0) {
        *to += sum;
    }
}

static __device__ int row_of(const int *index, int64_t r) {
    return index ? index[r] : (int)r;
}

/* ---- rows ---- */

static __global__ void gather(uint32_t count, int width, uint32_t pitch,
                              const int *__restrict__ index, const float *__restrict__ from,
                              float *__restrict__ to) {
    const uint32_t i = (uint32_t)item();
    if (i < count) {
        const int column = (int)(i % pitch);
        to[i] = column < width ? from[(int64_t)row_of(index, i / pitch) * width + column] : 0.0f;
    }
}

void gpu_gather(cudaStream_t stream, int rows, int width, int pitch, const int *index,
                const float *from, float *to) {
    const int64_t count = (int64_t)rows * pitch;
    LAUNCH(gather, blocks_of(count), line, stream, (uint32_t)count, width, (uint32_t)pitch, index,
           from, to);
}

static __global__ void mirror_history(GpuImages m, const float *history, float *to) {
    const uint32_t i = (uint32_t)item(), pitch = (uint32_t)m.pitch;
    const int width = m.frames * m.observation;
    if (i >= (uint32_t)m.images * pitch) {
        return;
    }
    const int column = (int)(i % pitch), k = column % m.observation;
    const int sample = m.order[m.which[i / pitch] - m.first];
    const float *row = history + (int64_t)sample * width;
    to[i] = column < width ? m.sign[k] * row[column - k + m.index[k]] : 0.0f;
}

void gpu_mirror_history(cudaStream_t stream, GpuImages m, const float *history, float *to) {
    LAUNCH(mirror_history, blocks_of((int64_t)m.images * m.pitch), line, stream, m, history, to);
}

static __global__ void latent_noise(int64_t count, int latent, const uint64_t *key, const int *row,
                                    float *noise) {
    const int64_t i = item();
    if (i >= count) {
        return;
    }
    const int64_t number = (int64_t)row[i / latent] * latent + i % latent;
    float even, odd;
    noise_pair((uint32_t)*key, (uint32_t)(*key >> 32), (uint32_t)(number / 2), &even, &odd);
    noise[i] = number % 2 ? odd : even;
}

void gpu_latent_noise(cudaStream_t stream, int rows, int latent, const uint64_t *key,
                      const int *row, float *noise) {
    const int64_t count = (int64_t)rows * latent;
    LAUNCH(latent_noise, blocks_of(count), line, stream, count, latent, key, row, noise);
}

/* ---- layers ---- */

static __device__ float activate(int elu, float x) {
    return elu ? vector_elu(x) : x;
}

/* A thread has four columns of a row. width: in fours. */
static __global__ void add_bias(uint32_t count, uint32_t width, int elu,
                                const float4 *__restrict__ bias, float4 *__restrict__ y) {
    const uint32_t i = (uint32_t)item();
    if (i >= count) {
        return;
    }
    const float4 b = bias[i % width];
    float4 x = y[i];
    x.x = activate(elu, x.x + b.x);
    x.y = activate(elu, x.y + b.y);
    x.z = activate(elu, x.z + b.z);
    x.w = activate(elu, x.w + b.w);
    y[i] = x;
}

void gpu_add_bias(cudaStream_t stream, int rows, int width, int elu, const float *bias, float *y) {
    const int64_t count = (int64_t)rows * (width / 4);
    LAUNCH(add_bias, blocks_of(count), line, stream, (uint32_t)count, (uint32_t)(width / 4), elu,
           (const float4 *)bias, (float4 *)y);
}

/* Block (column group, slice of rows): LANES partial sums a column, added in order. */
static __global__ void bias_backward(int rows, int width, const float *__restrict__ y,
                                     float *__restrict__ d, float *__restrict__ partial) {
    __shared__ float part[LANES][COLUMNS];
    const int column = (int)(blockIdx.x * COLUMNS + threadIdx.x), slice = (int)blockIdx.y;
    const int slices = (int)gridDim.y, end = (int)((int64_t)rows * (slice + 1) / slices);
    float sum = 0.0f;
    for (int r = (int)((int64_t)rows * slice / slices) + (int)threadIdx.y;
         column < width && r < end; r += LANES) {
        const int64_t i = (int64_t)r * width + column;
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

static __global__ void add_slices(int slices, int width, const float *partial, float beta,
                                  float *sum) {
    const int column = (int)item();
    if (column >= width) {
        return;
    }
    float total = 0.0f;
    for (int slice = 0; slice < slices; slice++) {
        total += partial[slice * width + column];
    }
    sum[column] = beta == 0.0f ? total : sum[column] + total;
}

void gpu_bias_backward(cudaStream_t stream, int rows, int width, const float *y, float *d,
                       float *partial, float beta, float *d_bias) {
    const int wanted = (rows + SLICE_ROWS - 1) / SLICE_ROWS,
              slices = wanted < GPU_SUM_SLICES ? wanted : GPU_SUM_SLICES;
    const dim3 grid = {(unsigned)((width + COLUMNS - 1) / COLUMNS), (unsigned)slices, 1},
               block = {COLUMNS, LANES, 1};
    LAUNCH(bias_backward, grid, block, stream, rows, width, y, d, partial);
    LAUNCH(add_slices, blocks_of(width), line, stream, slices, width, partial, beta, d_bias);
}

/* ---- rows between the networks ---- */

static __global__ void feet_input(GpuWidths w, uint32_t count, const float *heads, float *feet) {
    const uint32_t i = (uint32_t)item(), pitch = (uint32_t)w.feet;
    if (i < count) {
        const int column = (int)(i % pitch);
        const float *h = heads + (int64_t)(i / pitch) * w.heads + w.feet_offset;
        feet[i] = column < w.feet_count ? h[column] : 0.0f;
    }
}

void gpu_feet_input(cudaStream_t stream, GpuWidths w, int rows, const float *heads, float *feet) {
    const int64_t count = (int64_t)rows * w.feet;
    LAUNCH(feet_input, blocks_of(count), line, stream, w, (uint32_t)count, heads, feet);
}

/* One thread a number of the input [newest frame | estimates | theta1 z + theta2]. */
static __global__ void actor_input(GpuWidths w, uint32_t count, int newest, const float *history,
                                   const float *heads, const float *noise, const float *theta,
                                   float *input) {
    const uint32_t i = (uint32_t)item(), pitch = (uint32_t)w.actor_input;
    if (i >= count) {
        return;
    }
    const int64_t r = i / pitch;
    const int column = (int)(i % pitch), head = column - w.observation, j = head - w.estimates;
    const float *h = heads + r * w.heads;
    float x = 0.0f;
    if (head < 0) {
        x = history[r * w.history + newest + column];
    } else if (j < 0) {
        x = h[head];
    } else if (j < w.latent) {
        const float *t = theta + r * w.theta;
        const float *mu = h + w.estimates;
        const float z = loss_latent(mu, mu + w.latent, noise ? noise + r * w.latent : NULL, j);
        x = t[w.per_dimension ? j : 0] * z + t[w.per_dimension ? w.latent + j : 1];
    }
    input[i] = x;
}

void gpu_actor_input(cudaStream_t stream, GpuWidths w, int rows, int newest, const float *history,
                     const float *heads, const float *noise, const float *theta, float *input) {
    const int64_t count = (int64_t)rows * w.actor_input;
    LAUNCH(actor_input, blocks_of(count), line, stream, w, (uint32_t)count, newest, history, heads,
           noise, theta, input);
}

/* One thread a number of the decoder's input [z | estimates]. */
static __global__ void sample_latent(GpuWidths w, uint32_t count, const float *heads,
                                     const float *noise, float *spread, float *input) {
    const uint32_t i = (uint32_t)item(), pitch = (uint32_t)w.decoder_input;
    if (i >= count) {
        return;
    }
    const int64_t r = i / pitch;
    const int j = (int)(i % pitch);
    const float *h = heads + r * w.heads;
    if (j >= w.latent) {
        input[i] = j < w.latent + w.estimates ? h[j - w.latent] : 0.0f;
        return;
    }
    const float *mu = h + w.estimates;
    const float s = loss_spread(mu[w.latent + j]);
    spread[r * w.latent + j] = s;
    input[i] = mu[j] + s * noise[r * w.latent + j];
}

void gpu_sample_latent(cudaStream_t stream, GpuWidths w, int rows, const float *heads,
                       const float *noise, float *spread, float *input) {
    const int64_t count = (int64_t)rows * w.decoder_input;
    LAUNCH(sample_latent, blocks_of(count), line, stream, w, (uint32_t)count, heads, noise, spread,
           input);
}

/* ---- losses: one thread a sample ---- */

static __global__ void surrogate(GpuSurrogate s, int rows, double *sums) {
    const int64_t r = item();
    double loss = 0.0, divergence = 0.0, clipped = 0.0;
    if (r < rows) {
        const int actions = s.actions, i = s.order[r];
        const float *action = s.action + (int64_t)i * actions, *mean = s.mean + r * s.pitch;
        const LossSurrogate sample =
            loss_surrogate(actions, s.constant, s.clip, action, mean,
                           s.old_mean + (int64_t)i * actions, s.old_log_prob[i], s.advantage[i]);
        const float d_log_prob = sample.d_log_prob * s.weight;
        float *d_mean = s.d_mean + r * s.pitch, *d_log_std = s.d_log_std + r * s.pitch;
        for (int j = 0; j < actions; j++) {
            const float t = loss_standard(action[j], mean[j], s.constant[j]);
            d_mean[j] = loss_mean_gradient(d_log_prob, t, s.constant[j]);
            d_log_std[j] = loss_log_std_gradient(d_log_prob, t) - s.entropy;
        }
        for (int j = actions; j < s.pitch; j++) {
            d_log_std[j] = 0.0f;
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
        sum = loss_mirror(m.actions, m.index, m.sign, m.weight, m.mean + sample * m.pitch,
                          m.image + r * m.pitch, m.d_mean + sample * m.pitch,
                          m.d_image + r * m.pitch);
    }
    add_block_sum((double)sum / m.actions, sums + (int64_t)blockIdx.x * GPU_SUMS + GPU_SUM_MIRROR);
}

void gpu_mirror_loss(cudaStream_t stream, GpuMirror m, int images, double *sums) {
    LAUNCH(mirror_loss, blocks_of(images), line, stream, m, images, sums);
}

/* A block has THREADS rows and takes their numbers in order, so that neighbours read neighbours. */
static __global__ void reconstruction(GpuWidths w, int rows, float weight, const int *order,
                                      const float *frame, const float *critic, const float *decoded,
                                      float *d, double *sums) {
    const int pitch = w.decoded;
    const int64_t first = (int64_t)blockIdx.x * THREADS * pitch, count = (int64_t)rows * pitch;
    double loss = 0.0;
    for (int part = 0; part < 2; part++) { /* frame, ground */
        const int begin = part ? w.decoded_frame : 0;
        const int width = part ? w.ground_count : w.decoded_frame;
        const int stride = part ? w.critic_input : w.observation;
        const float *target = part ? critic + w.ground_offset : frame;
        double sum = 0.0;
        for (int k = 0; width > 0 && k < pitch; k++) {
            const uint32_t within = (uint32_t)(k * THREADS) + threadIdx.x;
            const int column = (int)(within % (uint32_t)pitch) - begin;
            const int64_t i = first + within;
            if (i < count && column >= 0 && column < width) {
                const int sample = order[(int64_t)blockIdx.x * THREADS + within / (uint32_t)pitch];
                const float gap = decoded[i] - target[(int64_t)sample * stride + column];
                sum += (double)(gap * gap);
                d[i] = weight / (float)width * gap;
            }
        }
        loss += width > 0 ? sum / width : 0.0;
    }
    add_block_sum(loss, sums + (int64_t)blockIdx.x * GPU_SUMS + GPU_SUM_RECONSTRUCTION);
}

void gpu_reconstruction(cudaStream_t stream, GpuWidths w, int rows, float weight, const int *order,
                        const float *frame, const float *critic, const float *decoded, float *d,
                        double *sums) {
    LAUNCH(reconstruction, blocks_of(rows), line, stream, w, rows, weight, order, frame, critic,
           decoded, d, sums);
}

static __global__ void modulation_backward(GpuWidths w, int rows, const float *heads,
                                           const float *noise, const float *theta,
                                           const float *d_input, float *d_heads, float *d_theta) {
    const int64_t r = item();
    if (r < rows) {
        loss_modulation(w.estimates, w.latent, w.per_dimension, w.modulation, heads + r * w.heads,
                        noise ? noise + r * w.latent : NULL, theta + r * w.theta,
                        d_input + r * w.actor_input + w.observation, d_heads + r * w.heads,
                        d_theta + r * w.theta);
    }
}

void gpu_modulation_backward(cudaStream_t stream, GpuWidths w, int rows, const float *heads,
                             const float *noise, const float *theta, const float *d_input,
                             float *d_heads, float *d_theta) {
    LAUNCH(modulation_backward, blocks_of(rows), line, stream, w, rows, heads, noise, theta,
           d_input, d_heads, d_theta);
}

static __device__ double latent_row(int latent, float weight, float free_bits, int sampled,
                                    const float *mu, const float *spread, const float *noise,
                                    const float *d_z, float *d_mu) {
    const float *logvar = mu + latent;
    float *d_logvar = d_mu + latent, twice = 0.0f;
    for (int j = 0; j < latent; j++) {
        const float own = loss_latent_twice(mu[j], logvar[j], spread[j]);
        const float w = loss_kl_weight(weight, free_bits, own);
        twice += own;
        const float d_draw = loss_draw_gradient(sampled, d_z[j], d_mu[j]);
        d_mu[j] += loss_mu_gradient(w, mu[j], d_z[j]);
        d_logvar[j] = loss_logvar_gradient(w, logvar[j], spread[j], noise[j], d_draw);
    }
    return 0.5 * (double)twice;
}

static __global__ void heads_backward(GpuWidths w, GpuHeads h, int rows, int all, double *sums) {
    const int64_t r = item();
    const int feet_end = w.feet_offset + w.feet_count;
    double group[3] = {0.0, 0.0, 0.0}, divergence = 0.0;
    float *d = h.d_heads + r * w.heads;
    for (int j = 0; r < all && j < w.feet_count; j++) {
        d[w.feet_offset + j] += h.d_feet[r * w.feet + j];
    }
    if (r < rows) {
        const float *heads = h.heads + r * w.heads;
        const float *target = h.target + (int64_t)h.order[r] * w.estimates;
        const float *d_input = h.d_decoder_input + r * w.decoder_input;
        for (int j = 0; j < w.estimates; j++) {
            d[j] += d_input[w.latent + j];
        }
        group[0] = loss_estimates(0, w.feet_offset, h.estimate_weight, heads, target, d);
        group[1] = loss_estimates(w.feet_offset, feet_end, h.estimate_weight, heads, target, d);
        group[2] = loss_estimates(feet_end, w.estimates, h.estimate_weight, heads, target, d);
        divergence =
            latent_row(w.latent, h.latent_weight, h.free_bits, h.sampled, heads + w.estimates,
                       h.spread + r * w.latent, h.noise + r * w.latent, d_input, d + w.estimates);
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

static __global__ void value_loss(GpuValue v, int rows, double *sums) {
    const int64_t r = item();
    double loss = 0.0;
    if (r < rows) {
        const int i = v.order[r];
        float half;
        const float gap = loss_value(v.clip_value, v.clip, v.value[r * v.pitch], v.old_value[i],
                                     v.returns[i], &half);
        loss = (double)gap * gap;
        v.d[r * v.pitch] = v.weight * half;
    }
    add_block_sum(loss, sums + (int64_t)blockIdx.x * GPU_SUMS + GPU_SUM_VALUE);
}

void gpu_value_loss(cudaStream_t stream, GpuValue v, int rows, double *sums) {
    LAUNCH(value_loss, blocks_of(rows), line, stream, v, rows, sums);
}
