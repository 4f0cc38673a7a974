#include "learn/cuda/update.h"

#include "learn/cuda/launch.h"
#include "learn/noise.h"
#include "learn/ppo_batch.h"
#include "learn/ppo_step.h"

/* ---- acting ---- */

static __global__ void sampled_noise(GpuSampled s, int64_t count, const GpuProgress *progress,
                                     float *noise) {
    const int64_t i = item();
    if (i >= count) {
        return;
    }
    const int row = (int)(i / s.latent), j = (int)(i % s.latent);
    const int own = row < s.rows ? row : s.which[row - s.rows] - s.at;
    const int sample = s.order ? s.order[own] : s.first + own;
    const uint64_t key = step_sampled_key(progress->seed, progress->iteration, sample / s.envs);
    const int64_t env = s.number + sample % s.envs;
    noise[i] = noise_number(key, env * s.latent + j);
}

void gpu_sampled_noise(cudaStream_t stream, GpuSampled s, const GpuProgress *progress,
                       float *noise) {
    const int64_t count = (int64_t)(s.rows + s.images) * s.latent;
    LAUNCH(sampled_noise, blocks_of(count), line, stream, s, count, progress, noise);
}

static __global__ void sample_actions(GpuActions a, PpoBatch b, const GpuProgress *progress) {
    const int64_t r = item();
    if (r >= a.rows) {
        return;
    }
    const int64_t env = a.first + r, i = (int64_t)a.t * b.envs + env;
    const uint64_t key = step_action_key(progress->seed, progress->iteration, a.t);
    float std[GPU_ACTIONS_MAX];
    float *mean = b.mean + i * a.actions, *action = b.action + i * a.actions;
    for (int j = 0; j < a.actions; j++) {
        std[j] = expf(a.log_std[j]);
        mean[j] = a.mean[r * a.pitch + j];
        action[j] = mean[j] + std[j] * noise_number(key, (a.number + env) * a.actions + j);
    }
    b.log_prob[i] = loss_log_prob(a.actions, action, mean, std);
}

void gpu_sample_actions(cudaStream_t stream, GpuActions a, PpoBatch batch,
                        const GpuProgress *progress) {
    LAUNCH(sample_actions, blocks_of(a.rows), line, stream, a, batch, progress);
}

/* ---- before the minibatches ---- */

/* Blocks of a sum over many items. */
static dim3 parts_of(int64_t items) {
    dim3 parts = blocks_of(items);
    parts.x = parts.x < GPU_PARTS ? parts.x : GPU_PARTS;
    return parts;
}

static __global__ void begin_update(PpoDef def, int actions, const float *log_std, GpuProgress *p) {
    if (threadIdx.x > 0) {
        return;
    }
    p->report = PpoReport();
    p->taken = p->starved = 0;
    p->moment[0] = p->moment[1] = p->moment[2] = 0.0;
    for (int j = 0; j < actions; j++) {
        p->old_std[j] = expf(log_std[j]);
    }
    p->ceiling = step_noise_ceiling(&def, p->iteration);
    p->average = step_average(&def, p->iteration);
}

void gpu_begin_update(cudaStream_t stream, PpoDef def, int actions, const float *log_std,
                      GpuProgress *progress) {
    LAUNCH(begin_update, one_block, line, stream, def, actions, log_std, progress);
}

/* One thread a column of an environment's frames. from: frames, or rows of the critic, [stride]. */
static __global__ void write_frames(PpoBatch b, int is_next, const float *from, int width,
                                    int stride) {
    const int64_t i = item();
    if (i >= (int64_t)b.envs * width) {
        return;
    }
    const int64_t env = i / width, column = i % width;
    for (int t = 0; t < b.steps; t++) {
        const int64_t now = (int64_t)t * b.envs + env;
        const int64_t row = is_next && returns_has_next(&b, t, now) ? now + b.envs : now;
        b.frame[now * width + column] = from[row * stride + column];
    }
}

void gpu_write_frames(cudaStream_t stream, PpoDef def, PpoBatch batch, int width, int stride) {
    LAUNCH(write_frames, blocks_of((int64_t)batch.envs * width), line, stream, batch,
           step_frame_is_next(&def), def.target_noise ? batch.frame : batch.critic, width,
           def.target_noise ? width : stride);
}

static __global__ void take_values(int rows, int pitch, const float *output, float *value) {
    const int64_t r = item();
    if (r < rows) {
        value[r] = output[r * pitch];
    }
}

void gpu_take_values(cudaStream_t stream, int rows, int pitch, const float *output, float *value) {
    LAUNCH(take_values, blocks_of(rows), line, stream, rows, pitch, output, value);
}

static __global__ void environments(double gamma, double lambda, PpoBatch b) {
    const int64_t env = item();
    if (env < b.envs) {
        returns_environment(gamma, lambda, &b, (int)env);
    }
}

/* A block has a stratum, a thread a run of its samples: first usable one of the run, of the runs
 * after it in the cycle, then backward over the run. */
static __global__ void substitute_samples(PpoBatch b, OrderPart part, int *substitute,
                                          GpuProgress *progress) {
    __shared__ int usable[THREADS];
    const OrderStratum s = order_part_stratum(b.steps, part, (int)blockIdx.x);
    const int self = (int)threadIdx.x, begin = order_begin(s.count, self, THREADS),
              end = order_begin(s.count, self + 1, THREADS);
    usable[self] = -1;
    for (int k = end - 1; k >= begin; k--) {
        const int i = order_sample(s, b.envs, k);
        usable[self] = returns_usable(&b, i) ? i : usable[self];
    }
    __syncthreads();
    int next = -1;
    for (int after = 1; after <= THREADS && next < 0; after++) {
        next = usable[(self + after) % THREADS];
    }
    for (int k = end - 1; k >= begin; k--) {
        const int i = order_sample(s, b.envs, k);
        next = returns_usable(&b, i) ? i : next;
        substitute[i] = next < 0 ? i : next;
    }
    if (self == 0 && s.count > 0 && next < 0) {
        progress->starved = 1;
    }
}

void gpu_returns(cudaStream_t stream, PpoDef def, PpoBatch batch, OrderPart part, int *substitute,
                 GpuProgress *progress) {
    const dim3 strata = {(unsigned)part.all, 1, 1};
    LAUNCH(environments, blocks_of(batch.envs), line, stream, def.gamma, def.lambda, batch);
    LAUNCH(substitute_samples, strata, line, stream, batch, part, substitute, progress);
}

enum { ADVANTAGE, RETURNS, VALUE, NUMBERS, STARVED = 1 + 2 * NUMBERS };
static_assert(STARVED + 1 == GPU_MOMENTS, "the sums of a moment");

static __global__ void add_moments(PpoBatch b, const GpuProgress *progress, double *partial) {
    const float *const numbers[NUMBERS] = {b.advantage, b.returns, b.value};
    const int64_t samples = (int64_t)b.steps * b.envs;
    double sum[GPU_MOMENTS] = {0.0};
    sum[STARVED] = item() == 0 ? progress->starved : 0.0;
    for (int64_t i = item(); i < samples; i += (int64_t)gridDim.x * THREADS) {
        if (returns_usable(&b, i)) {
            sum[0] += 1.0;
            for (int n = 0; n < NUMBERS; n++) {
                const double gap = numbers[n][i] - progress->moment[n];
                sum[1 + n] += gap;
                sum[1 + NUMBERS + n] += gap * gap;
            }
        }
    }
    for (int k = 0; k < GPU_MOMENTS; k++) {
        const double total = block_sum(sum[k]);
        if (threadIdx.x == 0) {
            partial[blockIdx.x * GPU_MOMENTS + k] = total;
        }
    }
}

int gpu_add_moments(cudaStream_t stream, PpoBatch batch, const GpuProgress *progress,
                    double *partial) {
    const dim3 parts = parts_of((int64_t)batch.steps * batch.envs);
    LAUNCH(add_moments, parts, line, stream, batch, progress, partial);
    return (int)parts.x;
}

static __global__ void finish_moments(int last, int rows, const double *partial,
                                      GpuProgress *progress) {
    double sum[GPU_MOMENTS];
    for (int k = 0; k < GPU_MOMENTS; k++) {
        sum[k] = block_sum((int)threadIdx.x < rows ? partial[threadIdx.x * GPU_MOMENTS + k] : 0.0);
    }
    const double count = fmax(sum[0], 1.0);
    if (threadIdx.x > 0) {
        return;
    }
    progress->starved = sum[STARVED] > 0.0;
    if (!last) {
        for (int n = 0; n < NUMBERS; n++) {
            progress->moment[n] = sum[1 + n] / count;
        }
        return;
    }
    const double *squares = sum + 1 + NUMBERS;
    progress->advantage_std = sqrt(squares[ADVANTAGE] / count);
    step_report_returns(&progress->report, progress->moment[VALUE], progress->advantage_std,
                        sqrt(squares[RETURNS] / count));
}

void gpu_finish_moments(cudaStream_t stream, int last, int rows, const double *partial,
                        GpuProgress *progress) {
    LAUNCH(finish_moments, one_block, line, stream, last, rows, partial, progress);
}

static __global__ void normalise(PpoBatch b, const GpuProgress *progress) {
    const int64_t i = item();
    if (i < (int64_t)b.steps * b.envs && returns_usable(&b, i)) {
        b.advantage[i] = (float)((b.advantage[i] - progress->moment[ADVANTAGE]) /
                                 (progress->advantage_std + 1e-8));
    }
}

void gpu_normalise(cudaStream_t stream, PpoBatch batch, const GpuProgress *progress) {
    LAUNCH(normalise, blocks_of((int64_t)batch.steps * batch.envs), line, stream, batch, progress);
}

/* ---- several processes ---- */

/* Sums over the rows of x [rows][width] into total [width], of the block's shared memory; every
 * thread of the block calls. Neighbours read neighbours: a thread has a column of every
 * (THREADS / width)-th row. */
static __device__ void rows_sum(int rows, int width, const double *x, double *total) {
    __shared__ double part[THREADS];
    const int thread = (int)threadIdx.x, used = THREADS / width * width,
              count = thread < used ? rows * width : 0;
    double sum = 0.0;
    TILE_UNROLL
    for (int i = thread; i < count; i += used) {
        sum += x[i];
    }
    part[thread] = sum;
    __syncthreads();
    if (thread < width) {
        sum = 0.0;
        for (int k = thread; k < used; k += width) {
            sum += part[k];
        }
        total[thread] = sum;
    }
    __syncthreads();
}

/* The first row becomes the sum. */
static __global__ void add_rows(int rows, int width, double *x) {
    __shared__ double total[THREADS];
    rows_sum(rows, width, x, total);
    if ((int)threadIdx.x < width) {
        x[threadIdx.x] = total[threadIdx.x];
    }
}

void gpu_add_rows(cudaStream_t stream, int rows, int width, double *x) {
    LAUNCH(add_rows, one_block, line, stream, rows, width, x);
}

/* Sums of 32-bit hashes are exact in double up to 2^21 parameters. */
static __global__ void add_hashes(int64_t count, const float *parameters, double *partial) {
    double sum = 0.0;
    for (int64_t i = item(); i < count; i += (int64_t)gridDim.x * THREADS) {
        uint32_t bits;
        memcpy(&bits, &parameters[i], sizeof bits);
        sum += noise_mix(bits ^ noise_mix((uint32_t)i));
    }
    sum = block_sum(sum);
    if (threadIdx.x == 0) {
        partial[blockIdx.x] = sum;
    }
}

static __global__ void finish_hash(int parts, const double *partial, GpuProgress *progress) {
    const double sum = block_sum((int)threadIdx.x < parts ? partial[threadIdx.x] : 0.0);
    if (threadIdx.x == 0) {
        progress->hash = sum;
    }
}

void gpu_hash(cudaStream_t stream, int64_t count, const float *parameters, double *partial,
              GpuProgress *progress) {
    const dim3 parts = parts_of(count);
    LAUNCH(add_hashes, parts, line, stream, count, parameters, partial);
    LAUNCH(finish_hash, one_block, line, stream, (int)parts.x, partial, progress);
}

/* ---- a minibatch ---- */

static __global__ void order_samples(GpuOrder o, const int *substitute, const GpuProgress *progress,
                                     int *order) {
    const int64_t p = item();
    if (p >= o.cut[PPO_SHARDS_MAX]) {
        return;
    }
    int shard = 0;
    while (p >= o.cut[shard + 1]) {
        shard++;
    }
    const OrderStratum stratum = order_part_stratum(o.steps, o.part, shard);
    const Order permutation =
        order_make(stratum.count, progress->seed, progress->iteration, o.epoch, shard);
    const int place = order_begin(stratum.count, o.m, o.minibatches) + (int)p - o.cut[shard];
    order[p] = substitute[order_sample(stratum, o.part.width, order_at(&permutation, place))];
}

void gpu_order(cudaStream_t stream, GpuOrder o, const int *substitute, const GpuProgress *progress,
               int *order) {
    LAUNCH(order_samples, blocks_of(o.cut[PPO_SHARDS_MAX]), line, stream, o, substitute, progress,
           order);
}

static __global__ void begin_minibatch(uint32_t draw, int actions, const float *log_std,
                                       GpuProgress *p) {
    if (threadIdx.x > 0) {
        return;
    }
    for (int j = 0; j < actions; j++) {
        p->std[j] = expf(log_std[j]);
    }
    loss_surrogate_constants(actions, p->std, p->old_std, p->constant);
    p->latent_key = step_latent_key(p->seed, p->iteration, draw);
}

void gpu_begin_minibatch(cudaStream_t stream, uint32_t draw, int actions, const float *log_std,
                         GpuProgress *progress) {
    LAUNCH(begin_minibatch, one_block, line, stream, draw, actions, log_std, progress);
}

static __global__ void add_squares(int64_t count, const float *gradient, double *partial) {
    double sum = 0.0;
    for (int64_t i = item(); i < count; i += (int64_t)gridDim.x * THREADS) {
        sum += (double)gradient[i] * gradient[i];
    }
    sum = block_sum(sum);
    if (threadIdx.x == 0) {
        partial[blockIdx.x] = sum;
    }
}

/* Returns whether the step is taken. */
static __device__ int decide_step(const GpuDecision *d, const LossSums *sums, double norm,
                                  GpuProgress *p) {
    const double weight = 1.0f / (float)d->samples;
    const double mirror_weight = d->images > 0 ? 1.0f / (float)d->images : 0.0f;
    if (p->starved || !step_report(&p->report, sums, weight, mirror_weight,
                                   step_entropy(d->actions, p->std), norm)) {
        p->report.skipped++;
        return 0;
    }
    p->learning_rate =
        step_learning_rate(&d->def, p->iteration, p->learning_rate, sums->kl / d->samples);
    p->step = adam_step(p->learning_rate, ++p->adam_steps, step_clip(&d->def, norm));
    p->taken++;
    return 1;
}

static __global__ void decide(GpuDecision d, int parts, const double *partial,
                              GpuProgress *progress) {
    __shared__ double total[GPU_SUMS];
    rows_sum(d.blocks, GPU_SUMS, d.sums, total);
    const double norm = sqrt(block_sum((int)threadIdx.x < parts ? partial[threadIdx.x] : 0.0));
    if (threadIdx.x > 0) {
        return;
    }
    LossSums sums;
    sums.surrogate = total[GPU_SUM_SURROGATE];
    sums.kl = total[GPU_SUM_KL];
    sums.clipped = total[GPU_SUM_CLIPPED];
    sums.reconstruction = total[GPU_SUM_RECONSTRUCTION];
    sums.vae_kl = total[GPU_SUM_VAE_KL];
    for (int g = 0; g < LOSS_GROUPS; g++) {
        sums.estimate[g] = total[GPU_SUM_ESTIMATE + g];
    }
    sums.mirror = total[GPU_SUM_MIRROR];
    sums.value = total[GPU_SUM_VALUE];
    progress->go = decide_step(&d, &sums, norm, progress);
}

void gpu_decide(cudaStream_t stream, GpuDecision d, double *partial, GpuProgress *progress) {
    const dim3 parts = parts_of(d.count);
    LAUNCH(add_squares, parts, line, stream, d.count, d.gradient, partial);
    LAUNCH(decide, one_block, line, stream, d, (int)parts.x, partial, progress);
}

/* Number of the matrix that parameter i belongs to; -1: Adam moves it. */
static __device__ int muon_find(const MuonMatrices &list, int64_t i) {
    for (int m = 0; m < list.count; m++) {
        const MuonMatrix &matrix = list.matrix[m];
        if (i >= matrix.at && i < matrix.at + (int64_t)matrix.rows * matrix.columns) {
            return m;
        }
    }
    return -1;
}

/* Where parameter i, of matrix m, is in muon.x. */
static __device__ int64_t muon_place(const GpuMuon &muon, int m, int64_t i) {
    const MuonMatrix &matrix = muon.list.matrix[m];
    const int k = (int)(i - matrix.at), row = k / matrix.columns, column = k % matrix.columns,
              is_wide = matrix.rows <= matrix.columns;
    return ((int64_t)m * muon.side + (is_wide ? row : column)) * muon.width +
           (is_wide ? column : row);
}

static __global__ void optimise(GpuOptimiser o, const GpuProgress *progress) {
    const int64_t i = item();
    if (i >= o.count || !progress->go) {
        return;
    }
    const int m = muon_find(o.muon.list, i);
    if (m >= 0) {
        o.muon.x[muon_place(o.muon, m, i)] =
            muon_direction(progress->step.gradient_scale * o.gradient[i], &o.first[i]);
        return;
    }
    adam_element(progress->step, o.gradient[i], &o.parameters[i], &o.first[i], &o.second[i]);
    if (i >= o.log_std && i < o.log_std + o.actions) {
        o.parameters[i] = fmaxf(o.parameters[i], o.floor);
    }
}

void gpu_optimise(cudaStream_t stream, GpuOptimiser o, const GpuProgress *progress) {
    LAUNCH(optimise, blocks_of(o.count), line, stream, o, progress);
}

/* A block belongs to matrix blockIdx.y. */
static __global__ void muon_polynomials(int side, int is_first, const float *gram, float *square) {
    const int64_t size = (int64_t)side * side, i = item();
    double trace = 0.0;
    gram += blockIdx.y * size;
    square += blockIdx.y * size;
    for (int k = (int)threadIdx.x; is_first && k < side; k += THREADS) {
        trace += gram[k * (int64_t)(side + 1)];
    }
    trace = block_sum(trace);
    if (i < size) {
        const float s = is_first ? muon_shrink(trace) : 1.0f;
        square[i] = muon_polynomial(s, i % (side + 1) == 0, gram[i], square[i]);
    }
}

void gpu_muon_polynomial(cudaStream_t stream, GpuMuon muon, int is_first) {
    dim3 blocks = blocks_of((int64_t)muon.side * muon.side);
    blocks.y = (unsigned)muon.list.count;
    LAUNCH(muon_polynomials, blocks, line, stream, muon.side, is_first, muon.gram, muon.square);
}

static __global__ void muon_step(GpuOptimiser o, const float *x, const GpuProgress *progress) {
    const int64_t i = item();
    const int m = muon_find(o.muon.list, i);
    if (m >= 0 && progress->go) {
        const float step = (float)progress->learning_rate * o.muon.list.matrix[m].scale;
        o.parameters[i] -= step * x[muon_place(o.muon, m, i)];
    }
}

void gpu_muon_apply(cudaStream_t stream, GpuOptimiser o, const float *x,
                    const GpuProgress *progress) {
    LAUNCH(muon_step, blocks_of(o.count), line, stream, o, x, progress);
}

/* ---- after the minibatches ---- */

static __global__ void bound_and_average(GpuOptimiser o, const GpuProgress *progress) {
    const int64_t i = item();
    if (i >= o.count) {
        return;
    }
    if (i >= o.log_std && i < o.log_std + o.actions) {
        o.parameters[i] = fminf(o.parameters[i], progress->ceiling);
    }
    if (o.mean) {
        o.mean[i] += progress->average * (o.parameters[i] - o.mean[i]);
    }
}

static __global__ void finish_update(GpuOptimiser o, GpuProgress *p) {
    if (threadIdx.x > 0) {
        return;
    }
    for (int j = 0; j < o.actions; j++) {
        p->std[j] = expf(o.parameters[o.log_std + j]);
    }
    step_finish_report(&p->report, p->taken, o.actions, p->std, p->learning_rate);
    p->iteration++;
}

void gpu_finish_update(cudaStream_t stream, GpuOptimiser o, GpuProgress *progress) {
    LAUNCH(bound_and_average, blocks_of(o.count), line, stream, o, progress);
    LAUNCH(finish_update, one_block, line, stream, o, progress);
}
