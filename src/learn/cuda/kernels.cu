#include "learn/cuda/kernels.h"

#include "learn/cuda/launch.h"
#include "learn/loss_sample.h"
#include "learn/noise.h"

#define FOURS_MAX 16 /* of columns, of a block in the column sums */
#define AHEAD 2      /* rows that a thread reads before it works on the first */
#define COLUMNS 8    /* of a block that adds up their slices; every width is a multiple */

#define ROWS 64 /* of a block that adds up losses, at least */

/* ---- numbers of an array ---- */

struct Bf16 {
    uint16_t bits;
};

/* Four neighbours, which a thread reads at once. */
template <class T> struct alignas(4 * sizeof(T)) Four { T at[4]; };

static __device__ float number_read(float x) {
    return x;
}

static __device__ float number_read(Bf16 x) {
    const uint32_t bits = (uint32_t)x.bits << 16;
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static __device__ void number_write(float *to, float x) {
    *to = x;
}

/* To the nearest, ties to even; NaN stays one. */
static __device__ void number_write(Bf16 *to, float x) {
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    bits += 0x7fffu + (bits >> 16 & 1u);
    to->bits = x == x ? (uint16_t)(bits >> 16) : (uint16_t)0x7fc0u;
}

/* The kernel, a template of one type of numbers, for those of an array. */
#define LAUNCH_FOR(array, kernel, grid, block, stream, ...)                                        \
    if ((array).bf16) {                                                                            \
        LAUNCH(kernel<Bf16>, grid, block, stream, __VA_ARGS__);                                    \
    } else {                                                                                       \
        LAUNCH(kernel<float>, grid, block, stream, __VA_ARGS__);                                   \
    }

int gpu_blocks(int rows) {
    return (rows + ROWS - 1) / ROWS;
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

/* A thread has four columns of a row. pitch: in fours. */
template <class T>
static __global__ void gather(uint32_t count, int width, uint32_t pitch,
                              const int *__restrict__ index, const float *__restrict__ from,
                              void *__restrict__ to) {
    const uint32_t i = (uint32_t)item();
    if (i >= count) {
        return;
    }
    const int column = 4 * (int)(i % pitch);
    const float *row = from + (int64_t)row_of(index, i / pitch) * width;
    Four<T> four;
    for (int k = 0; k < 4; k++) {
        number_write(&four.at[k], column + k < width ? row[column + k] : 0.0f);
    }
    ((Four<T> *)to)[i] = four;
}

void gpu_gather(cudaStream_t stream, int rows, int width, int pitch, const int *index,
                const float *from, GpuArray to) {
    const int64_t count = (int64_t)rows * (pitch / 4);
    LAUNCH_FOR(to, gather, blocks_of(count), line, stream, (uint32_t)count, width,
               (uint32_t)(pitch / 4), index, from, to.at)
}

/* As gather. */
template <class T>
static __global__ void mirror_history(GpuImages m, const float *history, void *to) {
    const uint32_t i = (uint32_t)item(), pitch = (uint32_t)m.pitch / 4;
    const int before = (m.frames - 1) * m.observation, width = before + m.observation + m.scan;
    if (i >= (uint32_t)m.images * pitch) {
        return;
    }
    const float *row = history + (int64_t)m.order[m.which[i / pitch] - m.first] * width;
    Four<T> four;
    for (int k = 0; k < 4; k++) {
        const int column = 4 * (int)(i % pitch) + k;
        const int own = column < before ? column % m.observation : column - before;
        number_write(&four.at[k],
                     column < width ? m.sign[own] * row[column - own + m.index[own]] : 0.0f);
    }
    ((Four<T> *)to)[i] = four;
}

void gpu_mirror_history(cudaStream_t stream, GpuImages m, const float *history, GpuArray to) {
    LAUNCH_FOR(to, mirror_history, blocks_of((int64_t)m.images * (m.pitch / 4)), line, stream, m,
               history, to.at)
}

static __global__ void latent_noise(uint32_t count, uint32_t latent, const uint64_t *key,
                                    const int *row, float *noise) {
    const uint32_t i = (uint32_t)item();
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
    LAUNCH(latent_noise, blocks_of(count), line, stream, (uint32_t)count, (uint32_t)latent, key,
           row, noise);
}

/* ---- layers ---- */

/* Of a number that is kept as a float, and of one that is kept in 8 bits. */
static __device__ float elu(float x, float) {
    return vector_elu(x);
}

static __device__ float elu(float x, Bf16) {
    return ON_GPU(x > 0.0f ? x : __expf(x) - 1.0f, vector_elu(x));
}

/* A thread has four columns of a row. width: in fours. */
template <class T>
static __global__ void add_bias(uint32_t count, uint32_t width, int is_hidden,
                                const Four<float> *__restrict__ bias, void *__restrict__ y) {
    const uint32_t i = (uint32_t)item();
    if (i >= count) {
        return;
    }
    const Four<float> b = bias[i % width];
    Four<T> four = ((Four<T> *)y)[i];
    for (int k = 0; k < 4; k++) {
        const float x = number_read(four.at[k]) + b.at[k];
        number_write(&four.at[k], is_hidden ? elu(x, four.at[k]) : x);
    }
    ((Four<T> *)y)[i] = four;
}

void gpu_add_bias(cudaStream_t stream, int rows, int width, int elu, const float *bias,
                  GpuArray y) {
    const int64_t count = (int64_t)rows * (width / 4);
    LAUNCH_FOR(y, add_bias, blocks_of(count), line, stream, (uint32_t)count, (uint32_t)(width / 4),
               elu, (const Four<float> *)bias, y.at)
}

/* Block (group of columns, slice of rows), [lanes][fours] threads: a thread has four columns of
 * every lanes-th row. Their sums are added up pairwise. width, fours: in fours. */
template <class D, class T>
static __global__ void bias_backward(int rows, int width, int fours, const Four<T> *y,
                                     const Four<D> *d, Four<T> *to, Four<float> *partial) {
    __shared__ Four<float> part[THREADS];
    const int column = (int)blockIdx.x * fours + (int)threadIdx.x, slice = (int)blockIdx.y;
    const int slices = (int)gridDim.y, lanes = THREADS / fours, lane = (int)threadIdx.y;
    const int end = (int)((int64_t)rows * (slice + 1) / slices);
    Four<float> sum = {{0.0f, 0.0f, 0.0f, 0.0f}};
    for (int r = (int)((int64_t)rows * slice / slices) + lane; column < width && r < end;
         r += AHEAD * lanes) {
        Four<D> own[AHEAD] = {}; /* beyond the slice 0, which adds nothing */
        Four<T> four[AHEAD] = {};
        for (int n = 0; n < AHEAD && r + n * lanes < end; n++) {
            const int64_t i = (int64_t)(r + n * lanes) * width + column;
            own[n] = d[i];
            if (y) {
                four[n] = y[i];
            }
        }
        for (int n = 0; n < AHEAD; n++) {
            for (int k = 0; k < 4; k++) {
                float x = number_read(own[n].at[k]);
                x *= y ? vector_elu_slope(number_read(four[n].at[k])) : 1.0f;
                number_write(&four[n].at[k], x);
                sum.at[k] += x;
            }
            if (to && r + n * lanes < end) {
                to[(int64_t)(r + n * lanes) * width + column] = four[n];
            }
        }
    }
    Four<float> *own = part + lane * fours + (int)threadIdx.x;
    *own = sum;
    for (int left = lanes, half; left > 1; left = half) {
        half = (left + 1) / 2;
        __syncthreads();
        for (int k = 0; k < 4 && lane + half < left; k++) {
            own->at[k] += own[half * fours].at[k];
        }
    }
    if (lane == 0 && column < width) {
        partial[slice * width + column] = *own;
    }
}

template <class D, class T>
static void launch_bias_backward(cudaStream_t stream, dim3 grid, dim3 block, int rows, int width,
                                 GpuArray y, GpuArray d, GpuArray to, float *partial) {
    const auto kernel = bias_backward<D, T>;
    LAUNCH(kernel, grid, block, stream, rows, width, (int)block.x, (const Four<T> *)y.at,
           (const Four<D> *)d.at, (Four<T> *)to.at, (Four<float> *)partial);
}

int gpu_bias_backward(cudaStream_t stream, int rows, int width, GpuArray y, GpuArray d, GpuArray to,
                      float *partial) {
    const int all = width / 4, fours = all < FOURS_MAX ? all : FOURS_MAX, lanes = THREADS / fours,
              wanted = (rows + 4 * lanes - 1) / (4 * lanes),
              slices = wanted < GPU_SUM_SLICES ? wanted : GPU_SUM_SLICES;
    const dim3 grid = {(unsigned)((all + fours - 1) / fours), (unsigned)slices, 1},
               block = {(unsigned)fours, (unsigned)lanes, 1};
    if (d.bf16) {
        launch_bias_backward<Bf16, Bf16>(stream, grid, block, rows, all, y, d, to, partial);
    } else if (to.bf16) {
        launch_bias_backward<float, Bf16>(stream, grid, block, rows, all, y, d, to, partial);
    } else {
        launch_bias_backward<float, float>(stream, grid, block, rows, all, y, d, to, partial);
    }
    return slices;
}

/* A block has COLUMNS columns of one of the sums, and SHARES threads for each: a thread adds up
 * every SHARES-th slice, then the first one adds up theirs. */
static __global__ void add_columns(GpuColumns list, const float *__restrict__ partial, float beta,
                                   float *gradient) {
    enum { SHARES = THREADS / COLUMNS };
    __shared__ float part[THREADS];
    const int share = (int)threadIdx.x / COLUMNS;
    int n = 0, column = (int)(blockIdx.x * COLUMNS + threadIdx.x % COLUMNS);
    while (column >= list.sum[n].width) {
        column -= list.sum[n++].width;
    }
    const GpuColumnSum own = list.sum[n];
    float total = 0.0f;
    TILE_UNROLL
    for (int slice = share; slice < own.slices; slice += SHARES) {
        total += partial[own.partial + (int64_t)slice * own.pitch + column];
    }
    part[threadIdx.x] = total;
    __syncthreads();
    if (share > 0) {
        return;
    }
    for (int k = 1; k < SHARES; k++) {
        total += part[k * COLUMNS + (int)threadIdx.x];
    }
    float *to = gradient + own.to + column;
    *to = beta == 0.0f ? total : *to + total;
}

void gpu_add_columns(cudaStream_t stream, GpuColumns list, const float *partial, float beta,
                     float *gradient) {
    dim3 grid = {0, 1, 1};
    for (int n = 0; n < list.count; n++) {
        grid.x += (unsigned)(list.sum[n].width / COLUMNS);
    }
    LAUNCH(add_columns, grid, line, stream, list, partial, beta, gradient);
}

static __global__ void round_numbers(int64_t count, const float *from, Bf16 *to) {
    const int64_t i = item();
    if (i < count) {
        number_write(to + i, from[i]);
    }
}

void gpu_round(cudaStream_t stream, int64_t count, const float *from, GpuArray to) {
    LAUNCH(round_numbers, blocks_of(count), line, stream, count, from, (Bf16 *)to.at);
}

/* ---- rows between the networks ---- */

static __global__ void hide_clock(int64_t count, int pitch, int frames, int observation,
                                  float *weight) {
    const int64_t i = item();
    if (i < count) {
        float *clock = weight + i / frames * pitch + (i % frames + 1) * observation;
        clock[-2] = 0.0f;
        clock[-1] = 0.0f;
    }
}

void gpu_hide_clock(cudaStream_t stream, int rows, int pitch, int frames, int observation,
                    float *weight) {
    const int64_t count = (int64_t)rows * frames;
    LAUNCH(hide_clock, blocks_of(count), line, stream, count, pitch, frames, observation, weight);
}

template <class T>
static __global__ void feet_input(GpuWidths w, uint32_t count, int newest, const void *history,
                                  const float *heads, void *feet) {
    const uint32_t i = (uint32_t)item(), pitch = (uint32_t)w.feet;
    if (i >= count) {
        return;
    }
    const int64_t r = i / pitch;
    const int column = (int)(i % pitch), clock = column - w.feet_input;
    const T *end = (const T *)history + r * w.history + newest + w.observation;
    float x = 0.0f;
    if (clock < 0) {
        x = heads[r * w.heads + w.feet_offset + column];
    } else if (clock < w.clock_input) {
        x = number_read(end[clock - w.clock_input]);
    }
    number_write((T *)feet + i, x);
}

void gpu_feet_input(cudaStream_t stream, GpuWidths w, int rows, int newest, GpuArray history,
                    const float *heads, GpuArray feet) {
    const int64_t count = (int64_t)rows * w.feet;
    LAUNCH_FOR(feet, feet_input, blocks_of(count), line, stream, w, (uint32_t)count, newest,
               history.at, heads, feet.at)
}

/* A number of the input [newest frame | scan | estimates | theta1 z + theta2]. */
template <class T>
static __device__ float actor_number(const GpuWidths &w, const T *newest, const float *heads,
                                     const float *noise, const float *theta, int column) {
    const int head = column - w.newest, j = head - w.estimates;
    if (head < 0) {
        return number_read(newest[column]);
    }
    if (j < 0) {
        return heads[head];
    }
    const float *mu = heads + w.estimates;
    return j < w.latent
               ? theta[w.per_dimension ? j : 0] * loss_latent(mu, mu + w.latent, noise, j) +
                     theta[w.per_dimension ? w.latent + j : 1]
               : 0.0f;
}

/* A thread has four columns of a row. */
template <class T>
static __global__ void actor_input(GpuWidths w, uint32_t count, int newest, const void *history,
                                   const float *heads, const float *noise, const float *theta,
                                   void *input) {
    const uint32_t i = (uint32_t)item(), pitch = (uint32_t)w.actor_input / 4;
    if (i >= count) {
        return;
    }
    const int64_t r = i / pitch;
    Four<T> four;
    for (int k = 0; k < 4; k++) {
        number_write(&four.at[k],
                     actor_number(w, (const T *)history + r * w.history + newest,
                                  heads + r * w.heads, noise ? noise + r * w.latent : NULL,
                                  theta + r * w.theta, 4 * (int)(i % pitch) + k));
    }
    ((Four<T> *)input)[i] = four;
}

void gpu_actor_input(cudaStream_t stream, GpuWidths w, int rows, int newest, GpuArray history,
                     const float *heads, const float *noise, const float *theta, GpuArray input) {
    const int64_t count = (int64_t)rows * (w.actor_input / 4);
    LAUNCH_FOR(input, actor_input, blocks_of(count), line, stream, w, (uint32_t)count, newest,
               history.at, heads, noise, theta, input.at)
}

/* One thread a number of the decoder's input [z | estimates]. */
template <class T>
static __global__ void sample_latent(GpuWidths w, uint32_t count, const float *heads,
                                     const float *noise, void *to) {
    T *input = (T *)to;
    const uint32_t i = (uint32_t)item(), pitch = (uint32_t)w.decoder_input;
    if (i >= count) {
        return;
    }
    const int64_t r = i / pitch;
    const int j = (int)(i % pitch);
    const float *h = heads + r * w.heads;
    if (j >= w.latent) {
        number_write(input + i, j < w.latent + w.estimates ? h[j - w.latent] : 0.0f);
        return;
    }
    const float *mu = h + w.estimates;
    number_write(input + i, loss_latent(mu, mu + w.latent, noise + r * w.latent, j));
}

void gpu_sample_latent(cudaStream_t stream, GpuWidths w, int rows, const float *heads,
                       const float *noise, GpuArray input) {
    const int64_t count = (int64_t)rows * w.decoder_input;
    LAUNCH_FOR(input, sample_latent, blocks_of(count), line, stream, w, (uint32_t)count, heads,
               noise, input.at)
}

/* ---- losses ---- */

/* A block's threads in rows: one has column `column`, and from there on every side-th, of rows
 * first, first + lanes .. end - 1. Threads that are left over have no rows. */
struct ThreadRows {
    int column, side, first, lanes, end;
};

/* Of rows begin .. end - 1. */
static __device__ ThreadRows rows_of(int columns, int begin, int end) {
    ThreadRows s;
    s.side = columns < THREADS ? columns : THREADS;
    s.lanes = THREADS / s.side;
    s.column = (int)threadIdx.x % s.side;
    s.first = begin + (int)threadIdx.x / s.side;
    s.end = (int)threadIdx.x < s.lanes * s.side ? end : 0;
    return s;
}

/* Of a block's ROWS rows. */
static __device__ ThreadRows rows_of_block(int columns, int rows) {
    const int begin = (int)blockIdx.x * ROWS;
    return rows_of(columns, begin, begin + ROWS < rows ? begin + ROWS : rows);
}

/* Losses of sample i, from the terms of its actions; adds them to loss, which has the order of the
 * sums. Returns the gradient of its log_prob. */
static __device__ float surrogate_sample(const GpuSurrogate &s, int i, const float *squares,
                                         const float *shifts, float *loss) {
    const float old_log_prob = s.old_log_prob[i], advantage = s.advantage[i];
    float log_prob = s.constant[s.actions], kl = s.constant[s.actions + 1];
    for (int j = 0; j < s.actions; j++) {
        log_prob -= squares[j];
        kl += shifts[j];
    }
    const LossSurrogate sample = loss_surrogate_of(s.clip, log_prob, kl, old_log_prob, advantage);
    loss[0] += sample.loss;
    loss[1] += sample.kl;
    loss[2] += (float)sample.clipped;
    return sample.d_log_prob * s.weight;
}

/* A block has a slice of the samples, and takes DEEP of them a thread at a time: neighbours have
 * the actions of a sample, then one thread adds up its terms, then neighbours have the gradients of
 * its actions. Sums of log std: partial [slices][pitch]. */
static __global__ void surrogate(GpuSurrogate s, int rows, double *sums, float *partial) {
    enum { DEEP = 4, SIDE_MIN = 8, TILE_MAX = DEEP * THREADS / SIDE_MIN };
    __shared__ float squares[DEEP * THREADS + TILE_MAX], shifts[DEEP * THREADS + TILE_MAX],
        d_log_prob[TILE_MAX], part[THREADS];
    const int slice = (int)blockIdx.x, slices = (int)gridDim.x, thread = (int)threadIdx.x;
    const int end = (int)((int64_t)rows * (slice + 1) / slices);
    const ThreadRows own = rows_of(s.pitch, 0, 1);
    const int j = own.column, tile = DEEP * own.lanes, stride = own.side + 1;
    const int is_action = own.end && j < s.actions;
    const float inverse = is_action ? s.constant[j] : 0.0f;
    float d_log_std = 0.0f, loss[3] = {0.0f, 0.0f, 0.0f};
    for (int at = (int)((int64_t)rows * slice / slices); at < end; at += tile) {
        int sample[DEEP]; /* -1: none */
        float t[DEEP] = {}, shift[DEEP] = {};
        for (int n = 0; n < DEEP; n++) {
            const int r = at + own.first + n * own.lanes;
            sample[n] = is_action && r < end ? s.order[r] : -1;
        }
        for (int n = 0; n < DEEP; n++) {
            const int64_t i = (int64_t)sample[n] * s.actions + j;
            if (sample[n] >= 0) {
                const float mean = s.mean[(at + own.first + n * own.lanes) * s.pitch + j];
                t[n] = loss_standard(s.action[i], mean, inverse);
                shift[n] = loss_standard(s.old_mean[i], mean, inverse);
            }
        }
        for (int n = 0; n < DEEP && is_action; n++) {
            const int place = (own.first + n * own.lanes) * stride + j;
            squares[place] = 0.5f * t[n] * t[n];
            shifts[place] = 0.5f * shift[n] * shift[n];
        }
        __syncthreads();
        if (thread < tile && at + thread < end) {
            d_log_prob[thread] = surrogate_sample(
                s, s.order[at + thread], squares + thread * stride, shifts + thread * stride, loss);
        }
        __syncthreads();
        for (int n = 0; n < DEEP; n++) {
            const int row = own.first + n * own.lanes;
            if (sample[n] >= 0) {
                const float d = d_log_prob[row];
                s.d_mean[(at + row) * s.pitch + j] = loss_mean_gradient(d, t[n], inverse);
                d_log_std += loss_log_std_gradient(d, t[n]) - s.entropy;
            }
        }
    }
    part[thread] = d_log_std;
    for (int k = 0; k < 3; k++) {
        add_block_sum((double)loss[k], sums + (int64_t)slice * GPU_SUMS + GPU_SUM_SURROGATE + k);
    }
    for (int lane = 1; thread < own.side && lane < own.lanes; lane++) {
        d_log_std += part[lane * own.side + thread];
    }
    if (thread < own.side) {
        partial[slice * own.side + thread] = d_log_std;
    }
}

int gpu_surrogate(cudaStream_t stream, GpuSurrogate s, int rows, double *sums, float *partial) {
    const int blocks = gpu_blocks(rows), slices = blocks < GPU_SUM_SLICES ? blocks : GPU_SUM_SLICES;
    const dim3 grid = {(unsigned)slices, 1, 1};
    LAUNCH(surrogate, grid, line, stream, s, rows, sums, partial);
    return slices;
}

/* A sample has at most one image: no two threads write one number. index is a permutation. */
static __global__ void mirror_loss(GpuMirror m, int images, double *sums) {
    const ThreadRows own = rows_of_block(m.actions, images);
    const int j = own.column, k = m.index[j];
    const float sign = m.sign[j];
    float sum = 0.0f;
    for (int r = own.first; r < own.end; r += own.lanes) {
        const int sample = (m.which[r] - m.first) * m.pitch, image = r * m.pitch;
        sum += loss_mirror_action(m.weight, sign, m.mean[sample + j], m.image[image + k],
                                  m.d_mean + sample + j, m.d_image + image + k);
    }
    add_block_sum((double)sum / m.actions, sums + (int64_t)blockIdx.x * GPU_SUMS + GPU_SUM_MIRROR);
}

void gpu_mirror_loss(cudaStream_t stream, GpuMirror m, int images, double *sums) {
    const dim3 grid = {(unsigned)gpu_blocks(images), 1, 1};
    LAUNCH(mirror_loss, grid, line, stream, m, images, sums);
}

static __global__ void
reconstruction(GpuWidths w, int rows, float weight, const int *__restrict__ order,
               const float *__restrict__ frame, const float *__restrict__ critic,
               const float *__restrict__ decoded, float *__restrict__ d, double *sums) {
    const int columns = w.decoded_frame + w.ground_count;
    const ThreadRows own = rows_of_block(columns, rows);
    double loss = 0.0;
    for (int column = own.column; column < columns; column += own.side) {
        const int is_ground = column >= w.decoded_frame,
                  width = is_ground ? w.ground_count : w.decoded_frame,
                  stride = is_ground ? w.critic_input : w.observation;
        const float *target =
            is_ground ? critic + w.ground_offset + column - w.decoded_frame : frame + column;
        const float weight_each = weight / (float)width;
        float sum = 0.0f;
        for (int r = own.first; r < own.end; r += own.lanes) {
            const int i = r * w.decoded + column;
            const float gap = decoded[i] - target[(int64_t)order[r] * stride];
            sum += gap * gap;
            d[i] = weight_each * gap;
        }
        loss += (double)sum / width;
    }
    add_block_sum(loss, sums + (int64_t)blockIdx.x * GPU_SUMS + GPU_SUM_RECONSTRUCTION);
}

void gpu_reconstruction(cudaStream_t stream, GpuWidths w, int rows, float weight, const int *order,
                        const float *frame, const float *critic, const float *decoded, float *d,
                        double *sums) {
    const dim3 grid = {(unsigned)gpu_blocks(rows), 1, 1};
    LAUNCH(reconstruction, grid, line, stream, w, rows, weight, order, frame, critic, decoded, d,
           sums);
}

/* One thread a number of d_theta. */
static __global__ void modulation_theta(GpuWidths w, uint32_t count, const float *heads,
                                        const float *noise, const float *d_input, float *d_theta) {
    const uint32_t i = (uint32_t)item(), pitch = (uint32_t)w.theta;
    const int64_t r = i / pitch;
    const int column = (int)(i % pitch);
    if (i < count && column < (w.per_dimension ? 2 * w.latent : 2)) {
        d_theta[i] =
            w.modulation
                ? loss_modulation_theta(w.estimates, w.latent, w.per_dimension, heads + r * w.heads,
                                        noise ? noise + r * w.latent : NULL,
                                        d_input + r * w.actor_input + w.newest, column)
                : 0.0f;
    }
}

void gpu_modulation_backward(cudaStream_t stream, GpuWidths w, int rows, const float *heads,
                             const float *noise, const float *d_input, float *d_theta) {
    const int64_t count = (int64_t)rows * w.theta;
    LAUNCH(modulation_theta, blocks_of(count), line, stream, w, (uint32_t)count, heads, noise,
           d_input, d_theta);
}

/* Dimension j of a row's latent: mu and logvar. Returns twice its KL term, of an image 0. Reads all
 * its numbers before it needs one. */
static __device__ float latent_backward(const GpuWidths &w, const GpuHeads &h, int r, int j,
                                        int is_image) {
    const int at_mu = w.estimates + j, at_logvar = at_mu + w.latent;
    const float *heads = h.heads + r * w.heads;
    float *d_heads = h.d_heads + r * w.heads;
    const float mu = heads[at_mu], logvar = heads[at_logvar],
                noise = is_image && !h.sampled ? 0.0f : h.noise[r * w.latent + j],
                d_z = is_image ? 0.0f : h.d_decoder_input[r * w.decoder_input + j],
                d_mu = loss_modulation_head(w.estimates, w.latent, w.per_dimension, heads, NULL,
                                            h.theta + r * w.theta,
                                            h.d_input + r * w.actor_input + w.newest, at_mu);
    const float spread = loss_spread(logvar), twice = loss_latent_twice(mu, logvar, spread),
                weight = is_image ? 0.0f : loss_kl_weight(h.latent_weight, h.free_bits, twice);
    d_heads[at_mu] = d_mu + loss_mu_gradient(weight, mu, d_z);
    d_heads[at_logvar] = loss_logvar_gradient(weight, logvar, spread, noise,
                                              loss_draw_gradient(h.sampled, d_z, d_mu));
    return is_image ? 0.0f : twice;
}

/* Estimate j of a row. weight: twice that of its square. Returns the square, of an image 0. */
static __device__ float estimate_backward(const GpuWidths &w, const GpuHeads &h, int r, int j,
                                          int is_image, int sample, float weight) {
    const int i = r * w.heads + j, foot = j - w.feet_offset;
    const float estimate = h.heads[i],
                target = is_image ? 0.0f : h.target[(int64_t)sample * w.estimates + j],
                d_feet = foot >= 0 && foot < w.feet_input ? h.d_feet[r * w.feet + foot] : 0.0f,
                d_decoder = is_image ? 0.0f : h.d_decoder_input[r * w.decoder_input + w.latent + j];
    float d = h.d_input[r * w.actor_input + w.newest + j] + d_feet + d_decoder;
    const float square = is_image ? 0.0f : loss_estimate(weight, estimate, target, &d);
    h.d_heads[i] = d;
    return square;
}

/* A thread has estimate j and dimension j of the latent of its rows, so that neighbours read
 * neighbours, and each several numbers at a time. */
static __global__ void __launch_bounds__(THREADS, 5)
    heads_backward(GpuWidths w, GpuHeads h, int rows, int all, double *sums) {
    const int feet_end = w.feet_offset + w.feet_count,
              widths[] = {w.feet_offset, w.feet_count, w.estimates - feet_end},
              columns = w.estimates > w.latent ? w.estimates : w.latent;
    const ThreadRows own = rows_of_block(columns, all);
    float squares[3] = {0.0f, 0.0f, 0.0f}, twice = 0.0f;
    for (int j = own.column; j < columns; j += own.side) {
        const int group = (j >= w.feet_offset) + (j >= feet_end);
        const int width = group == 0 ? widths[0] : group == 1 ? widths[1] : widths[2];
        const float weight = h.estimate_weight / (float)width;
        float square = 0.0f;
        LANE_ROLLED
        for (int r = own.first; r < own.end; r += own.lanes) {
            const int is_image = r >= rows, sample = is_image ? 0 : h.order[r];
            if (j < w.latent) {
                twice += latent_backward(w, h, r, j, is_image);
            }
            if (j < w.estimates) {
                square += estimate_backward(w, h, r, j, is_image, sample, weight);
            }
        }
        for (int g = 0; g < 3; g++) {
            squares[g] += g == group ? square : 0.0f;
        }
    }
    double *to = sums + (int64_t)blockIdx.x * GPU_SUMS;
    for (int g = 0; g < 3; g++) {
        add_block_sum(widths[g] > 0 ? (double)squares[g] / widths[g] : 0.0,
                      to + GPU_SUM_ESTIMATE + g);
    }
    add_block_sum(0.5 * (double)twice, to + GPU_SUM_VAE_KL);
}

void gpu_heads_backward(cudaStream_t stream, GpuWidths w, GpuHeads h, int rows, int all,
                        double *sums) {
    const dim3 grid = {(unsigned)gpu_blocks(all), 1, 1};
    LAUNCH(heads_backward, grid, line, stream, w, h, rows, all, sums);
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
