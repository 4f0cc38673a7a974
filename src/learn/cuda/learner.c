#include "learn/cuda/learner.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "device/ranks/ranks.h"
#include "learn/cuda/fused.h"
#include "learn/cuda/learner_private.h"
#include "learn/ppo_gradient.h"
#include "learn/ppo_step.h"

/* Rows go through the networks in chunks of at most this many. That fills a large device and bounds
 * the memory. */
#define ROWS_MAX 131072

/* [bytes] for cuBLAS, as its manual recommends for Hopper. Its own memory cannot be used while a
 * graph is captured. */
#define WORKSPACE ((size_t)32 << 20)

_Static_assert(GPU_ACTIONS_MAX == NETWORK_ACTIONS_MAX, "one bound");
_Static_assert(sizeof(LossSums) == GPU_SUMS * sizeof(double), "the same sums");

/* ---- sizes and memory ---- */

static int widest_layer(const Network *network) {
    int widest = 0;
    for (int i = 0; i < NETWORK_MLPS; i++) {
        const char *name;
        const int width = mlp_widest(network_mlp(network, i, &name));
        widest = width > widest ? width : widest;
    }
    return widest > network->history ? widest : network->history;
}

/* Floats that the partial sums of all biases and of log std take, of so many rows. */
static size_t partial_sums(const Network *network, int fused, int rows) {
    int64_t count = (int64_t)GPU_SUM_SLICES * (network->count - network->log_std);
    for (int i = 0; i < NETWORK_MLPS; i++) {
        const char *name;
        count += gpu_mlp_partial(network_mlp(network, i, &name), fused, rows);
    }
    return (size_t)count;
}

/* Most images that a run of this many samples of a minibatch can have: it has at most so many
 * chunks of the CPU's, each with as many images as a full one. */
static int most_images(const Ppo *ppo, int rows) {
    const int64_t images =
        ppo->mirror.observation_index
            ? (int64_t)(rows / PPO_CHUNK + 2 + ppo->def.shards) * ppo->mirror_rows
            : 0;
    return images < rows ? (int)images : rows;
}

/* envs: of all processes. */
static void set_sizes(GpuLearner *g, int envs) {
    const Ppo *ppo = g->ppo;
    const PolicyDef *def = policy_def(ppo->policy);
    const int steps = ppo->batch.steps;
    /* the elementwise passes count the numbers of a chunk with 32 bits */
    const int64_t most = (int64_t)INT32_MAX / (2 * widest_layer(&g->network)),
                  wanted = g->wanted_rows > 0 ? g->wanted_rows : ROWS_MAX;
    g->part = order_part(ppo->def.shards, envs, ranks_number(ppo->ranks), ranks_count(ppo->ranks));
    g->envs = g->part.width;
    g->minibatch = order_largest(steps, g->part, ppo->def.minibatches);
    int rows = g->minibatch > g->envs ? g->minibatch : g->envs;
    rows = rows < wanted ? rows : (int)wanted;
    g->rows = rows < most ? rows : (int)most;
    g->images = most_images(ppo, g->rows);
    g->sum_blocks = gpu_blocks(g->rows + g->images);
    const Network *n = &g->network;
    g->widths = (GpuWidths){.modulation = ppo->def.modulation,
                            .observation = def->observation,
                            .newest = n->newest,
                            .estimates = def->estimates,
                            .latent = def->latent,
                            .per_dimension = def->modulation_per_dimension,
                            .feet_offset = def->feet_velocity_offset,
                            .feet_count = def->feet_velocity_count,
                            .feet_input = n->feet,
                            .clock_input = n->clock,
                            .actions = def->actions,
                            .decoded_frame = n->decoded_frame,
                            .ground_offset = def->ground_offset,
                            .ground_count = def->ground_count,
                            .critic_input = def->critic_input,
                            .history = n->history,
                            .heads = n->heads,
                            .feet = n->modulation.layer[0].in,
                            .theta = n->theta,
                            .actor_input = n->actor_input,
                            .action = gpu_pitch(def->actions),
                            .decoder_input = n->decoder_input,
                            .decoded = gpu_pitch(n->decoded),
                            .value = gpu_pitch(1)};
}

static void *carve(char *block, size_t *used, size_t bytes) {
    void *at = block ? block + *used : NULL;
    *used += (bytes + 255) / 256 * 256;
    return at;
}

/* Places all arrays in the device's block and returns its bytes. NULL: only counts them. */
static size_t layout(GpuLearner *g, char *block) {
    const Network *n = &g->network;
    const size_t parameters = (size_t)n->count * sizeof(float),
                 samples = (size_t)g->ppo->batch.steps * (size_t)g->envs,
                 mirror = (size_t)n->newest + (size_t)n->def.actions;
    size_t used = 0;
    float **const vectors[] = {&g->parameters, &g->gradient, &g->first, &g->second, &g->average};
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) {
        const int wanted = vectors[i] != &g->average || g->ppo->average;
        *vectors[i] = wanted ? carve(block, &used, parameters) : NULL;
    }
    g->progress = carve(block, &used, sizeof *g->progress);
    g->mirror_index = carve(block, &used, mirror * sizeof *g->mirror_index);
    g->mirror_sign = carve(block, &used, mirror * sizeof *g->mirror_sign);
    g->substitute = carve(block, &used, samples * sizeof *g->substitute);
    g->latent_row = carve(block, &used, samples * sizeof *g->latent_row);
    g->which = carve(block, &used, samples * sizeof *g->which);
    g->order = carve(block, &used, (size_t)g->minibatch * sizeof *g->order);
    g->sums = carve(block, &used, (size_t)(g->sum_blocks * GPU_SUMS) * sizeof *g->sums);
    g->partial = carve(block, &used, (size_t)GPU_PARTS * GPU_MOMENTS * sizeof *g->partial);
    g->queue.partial =
        carve(block, &used, partial_sums(n, g->queue.fused, g->rows + g->images) * sizeof(float));
    g->workspace = carve(block, &used, WORKSPACE);
    g->batch.steps = g->ppo->batch.steps;
    g->batch.envs = g->envs;
    const Network *tight = &g->ppo->policy->network;
    g->rollout = carve(block, &used, ppo_carve_batch(&g->batch, tight, NULL));
    ppo_carve_batch(&g->batch, tight, g->rollout);
    const int bf16 = g->ppo->def.matmul == PPO_MATMUL_BF16;
    const size_t rounded = gpu_array_bytes(bf16, (size_t)n->count);
    g->queue.weights.bf16 = bf16;
    g->queue.weights.at = bf16 ? carve(block, &used, rounded) : g->parameters;
    char *muon = carve(block, &used, gpu_muon_carve(NULL, &g->muon));
    gpu_muon_carve(muon, &g->muon);
    const size_t bytes = gpu_chunk_carve(n, &g->widths, bf16, g->rows, g->images, NULL, &g->chunk);
    char *chunk = carve(block, &used, bytes);
    gpu_chunk_carve(n, &g->widths, bf16, g->rows, g->images, chunk, &g->chunk);
    return used;
}

/* Most robots for which everything fits into so many bytes. */
static int robots_that_fit(const GpuLearner *g, size_t bytes) {
    GpuLearner other = *g;
    int fits = 0, too_many = g->part.envs;
    while (too_many - fits > 1) {
        const int envs = fits + (too_many - fits) / 2;
        set_sizes(&other, envs);
        if (layout(&other, NULL) <= bytes) {
            fits = envs;
        } else {
            too_many = envs;
        }
    }
    return fits;
}

/* ---- traffic ---- */

/* Makes the learner's device the current one. Returns the one before, for leave. */
static int enter(const GpuLearner *g) {
    int before = 0;
    cudaGetDevice(&before);
    cudaSetDevice(g->device);
    return before;
}

static void leave(int before) {
    cudaSetDevice(before);
}

static MildStatus check(cudaError_t code, const char *what, MildError *error) {
    return code == cudaSuccess
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_IO, "GPU: %s: %s", what, cudaGetErrorString(code));
}

static void upload(GpuLearner *g, void *to, const void *from, size_t bytes) {
    cudaMemcpyAsync(to, from, bytes, cudaMemcpyHostToDevice, g->queue.stream);
}

static void download(GpuLearner *g, void *to, const void *from, size_t bytes) {
    cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToHost, g->queue.stream);
}

/* Waits for all enqueued work and returns its first failure. */
static MildStatus finish(GpuLearner *g, const char *what, MildError *error) {
    const cudaError_t launched = cudaGetLastError(), ran = cudaStreamSynchronize(g->queue.stream);
    MildStatus status = check(launched ? launched : ran, what, error);
    if (status == MILD_OK && g->queue.status) {
        status = mild_fail(error, MILD_ERROR_IO, "GPU: %s: %s", what,
                           cublasGetStatusString(g->queue.status));
    }
    if (status == MILD_OK && g->error.status) {
        status = mild_fail(error, g->error.status, "%s", g->error.text);
    }
    return status;
}

/* The rows of time t of the four arrays with a row after the last step. */
enum { CARRIED = 4 };
static void carried(const Network *n, const PpoBatch *b, int t, float *at[CARRIED],
                    size_t bytes[CARRIED]) {
    float *const arrays[CARRIED] = {b->history, b->critic, b->target, b->frame};
    const int widths[CARRIED] = {policy_history(&n->def), n->def.critic_input, n->def.estimates,
                                 n->def.observation};
    for (int i = 0; i < CARRIED; i++) {
        const size_t floats = (size_t)b->envs * (size_t)widths[i];
        at[i] = arrays[i] + (size_t)t * floats;
        bytes[i] = floats * sizeof(float);
    }
}

/* ---- parameters and counters ---- */

typedef struct {
    float *host, *device;
} Vector;

/* Parameters, moments and running mean, on the CPU and padded on the device. Returns their number.
 */
static int vectors(GpuLearner *g, Vector vector[4]) {
    Ppo *ppo = g->ppo;
    vector[0] = (Vector){ppo->policy->parameters, g->parameters};
    vector[1] = (Vector){ppo->first, g->first};
    vector[2] = (Vector){ppo->second, g->second};
    if (!ppo->average) {
        return 3;
    }
    vector[3] = (Vector){policy_parameters(ppo->average), g->average};
    return 4;
}

static MildStatus pull(GpuLearner *g, MildError *error) {
    Ppo *ppo = g->ppo;
    const size_t bytes = (size_t)g->network.count * sizeof(float);
    Vector vector[4];
    const int count = vectors(g, vector);
    for (int i = 0; i < count; i++) {
        download(g, g->padded, vector[i].device, bytes);
        const MildStatus status = finish(g, "pull", error);
        if (status) {
            return status;
        }
        gpu_network_strip(&ppo->policy->network, &g->network, g->padded, vector[i].host);
    }
    if (ppo->resident) {
        float *from[CARRIED], *to[CARRIED];
        size_t sizes[CARRIED];
        carried(&g->network, &g->batch, 0, from, sizes);
        carried(&g->network, &ppo->start, 0, to, sizes);
        for (int i = 0; i < CARRIED; i++) {
            download(g, to[i], from[i], sizes[i]);
        }
    }
    return finish(g, "pull", error);
}

static MildStatus push(GpuLearner *g, MildError *error) {
    const Ppo *ppo = g->ppo;
    const size_t bytes = (size_t)g->network.count * sizeof(float);
    Vector vector[4];
    const int count = vectors(g, vector);
    for (int i = 0; i < count; i++) {
        gpu_network_pad(&ppo->policy->network, &g->network, vector[i].host, g->padded);
        upload(g, vector[i].device, g->padded, bytes);
        const MildStatus status = finish(g, "push", error); /* before the next one is padded */
        if (status) {
            return status;
        }
    }
    const GpuProgress progress = {.seed = ppo->seed,
                                  .iteration = ppo->iteration,
                                  .adam_steps = ppo->adam_steps,
                                  .learning_rate = ppo->learning_rate};
    upload(g, g->progress, &progress, sizeof progress);
    gpu_enqueue_weights(g);
    if (ppo->resident) {
        float *from[CARRIED], *to[CARRIED];
        size_t sizes[CARRIED];
        carried(&g->network, &ppo->start, 0, from, sizes);
        carried(&g->network, &g->batch, 0, to, sizes);
        for (int i = 0; i < CARRIED; i++) {
            upload(g, to[i], from[i], sizes[i]);
        }
    }
    return finish(g, "push", error);
}

static MildStatus learner_pull(void *self, MildError *error) {
    const int before = enter(self);
    const MildStatus status = pull(self, error);
    leave(before);
    return status;
}

static MildStatus learner_push(void *self, MildError *error) {
    const int before = enter(self);
    const MildStatus status = push(self, error);
    leave(before);
    return status;
}

/* ---- acting ---- */

/* With the rollout on the CPU: copies what the networks read there, and what they give back. */
static MildStatus act_from_host(GpuLearner *g, int t, MildError *error) {
    const PpoBatch *host = &g->ppo->batch, *b = &g->batch;
    const size_t envs = (size_t)g->envs, row = (size_t)t * envs,
                 actions = (size_t)g->network.def.actions,
                 history = (size_t)g->ppo->policy->network.history;
    upload(g, b->history + row * history, host->history + row * history,
           envs * history * sizeof(float));
    gpu_enqueue_act(g, t);
    download(g, host->mean + row * actions, b->mean + row * actions,
             envs * actions * sizeof(float));
    download(g, host->action + row * actions, b->action + row * actions,
             envs * actions * sizeof(float));
    download(g, host->log_prob + row, b->log_prob + row, envs * sizeof(float));
    return finish(g, "act", error);
}

static MildStatus learner_act(void *self, int t, MildError *error) {
    GpuLearner *g = self;
    MildStatus status = MILD_OK;
    const int before = enter(g);
    if (g->ppo->resident) {
        gpu_enqueue_act(g, t);
    } else {
        status = act_from_host(g, t, error);
    }
    leave(before);
    return status;
}

/* ---- update ---- */

static GpuOptimiser optimiser(const GpuLearner *g) {
    return (GpuOptimiser){.count = g->network.count,
                          .log_std = g->network.log_std,
                          .actions = g->network.def.actions,
                          .floor = step_noise_floor(&g->ppo->def),
                          .gradient = g->gradient,
                          .parameters = g->parameters,
                          .first = g->first,
                          .second = g->second,
                          .mean = g->average,
                          .muon = g->muon};
}

static int is_alone(const GpuLearner *g) {
    return ranks_count(g->ppo->ranks) == 1;
}

/* Sums x [rows][width] over the processes. Returns how many rows are still to be added up. */
static int sum_rows(GpuLearner *g, double *x, int rows, int width) {
    if (is_alone(g)) {
        return rows;
    }
    gpu_add_rows(g->queue.stream, rows, width, x);
    ranks_sum_device_double(g->ppo->ranks, x, width, g->queue.stream, &g->error);
    return 1;
}

void gpu_enqueue_returns(GpuLearner *g) {
    cudaStream_t stream = g->queue.stream;
    gpu_returns(stream, g->ppo->def, g->batch, g->part, g->substitute, g->progress);
    for (int last = 0; last < 2; last++) {
        const int parts = gpu_add_moments(stream, g->batch, g->progress, g->partial),
                  rows = sum_rows(g, g->partial, parts, GPU_MOMENTS);
        gpu_finish_moments(stream, last, rows, g->partial, g->progress);
    }
    gpu_normalise(stream, g->batch, g->progress);
}

static void enqueue_minibatch(GpuLearner *g, const GpuOrder *order, const GpuMinibatch *minibatch) {
    const PpoDef *def = &g->ppo->def;
    cudaStream_t stream = g->queue.stream;
    const int actions = g->network.def.actions;
    gpu_order(stream, *order, g->substitute, g->progress, g->order);
    gpu_begin_minibatch(stream, (uint32_t)(order->epoch * def->minibatches + order->m), actions,
                        g->parameters + g->network.log_std, g->progress);
    gpu_enqueue_gradient(g, minibatch);
    ranks_sum_device(g->ppo->ranks, g->gradient, g->network.count, stream, &g->error);
    const GpuDecision decision = {.def = *def,
                                  .actions = actions,
                                  .samples = minibatch->samples,
                                  .images = minibatch->images,
                                  .blocks = sum_rows(g, g->sums, g->sum_blocks, GPU_SUMS),
                                  .count = g->network.count,
                                  .sums = g->sums,
                                  .gradient = g->gradient};
    gpu_decide(stream, decision, g->partial, g->progress);
    const GpuOptimiser step = optimiser(g);
    gpu_optimise(stream, step, g->progress);
    if (g->muon.list.count > 0) {
        gpu_enqueue_muon(g, &step);
    }
    gpu_enqueue_weights(g);
}

static void enqueue_epoch(GpuLearner *g, int epoch) {
    const int minibatches = g->ppo->def.minibatches;
    GpuOrder order = {
        .steps = g->batch.steps, .minibatches = minibatches, .epoch = epoch, .part = g->part};
    GpuMinibatch minibatch = {.first = 0};
    for (; order.m < minibatches; order.m++) {
        int cut[PPO_SHARDS_MAX + 1];
        minibatch.samples =
            order_cuts(g->part.all, order.steps, g->part.envs, order.m, minibatches, cut);
        minibatch.images = ppo_mirrored(g->ppo, cut, NULL);
        const int own = order_own_cuts(g->part, cut, order.cut);
        memcpy(minibatch.cut, order.cut, sizeof order.cut);
        if (minibatch.samples > 0) {
            enqueue_minibatch(g, &order, &minibatch);
        }
        minibatch.first += own;
    }
}

static void enqueue_update(GpuLearner *g) {
    const PpoDef *def = &g->ppo->def;
    const Network *n = &g->network;
    cudaStream_t stream = g->queue.stream;
    if (step_writes_frames(def)) {
        gpu_write_frames(stream, *def, g->batch, n->def.observation, n->def.critic_input);
    }
    gpu_begin_update(stream, *def, n->def.actions, g->parameters + n->log_std, g->progress);
    gpu_enqueue_values(g);
    gpu_enqueue_returns(g);
    for (int epoch = 0; epoch < def->epochs; epoch++) {
        enqueue_epoch(g, epoch);
    }
    gpu_finish_update(stream, optimiser(g), g->progress);
    if (!is_alone(g)) {
        gpu_hash(stream, n->count, g->parameters, g->partial, g->progress);
    }
    float *from[CARRIED], *to[CARRIED];
    size_t sizes[CARRIED];
    carried(n, &g->batch, g->batch.steps, from, sizes);
    carried(n, &g->batch, 0, to, sizes);
    for (int i = 0; i < CARRIED; i++) {
        cudaMemcpyAsync(to[i], from[i], sizes[i], cudaMemcpyDeviceToDevice, stream);
    }
}

/* Every update enqueues the same work, so the CPU needs to describe it only once. What cannot be
 * captured, by all processes, is enqueued anew each time, which only costs speed. */
static void capture_update(GpuLearner *g) {
    cudaGraph_t graph = NULL;
    const cublasStatus_t status = g->queue.status;
    if (cudaStreamBeginCapture(g->queue.stream, cudaStreamCaptureModeThreadLocal) == cudaSuccess) {
        enqueue_update(g);
        if (cudaStreamEndCapture(g->queue.stream, &graph) != cudaSuccess ||
            cudaGraphInstantiate(&g->graph, graph, 0) != cudaSuccess) {
            g->graph = NULL;
        }
    }
    if (graph) {
        cudaGraphDestroy(graph);
    }
    if (ranks_any(g->ppo->ranks, !g->graph) && g->graph) {
        cudaGraphExecDestroy(g->graph);
        g->graph = NULL;
    }
    if (!g->graph) {
        cudaGetLastError();
        g->queue.status = status;
        g->error.status = MILD_OK;
    }
}

/* The first update is not captured, because cuBLAS loads its kernels then. */
static MildStatus update(GpuLearner *g, PpoReport *report, MildError *error) {
    Ppo *ppo = g->ppo;
    if (!ppo->resident) {
        upload(g, g->rollout, ppo->batch_block, ppo->batch_bytes);
    }
    if (g->updates++ == 1) {
        capture_update(g);
    }
    if (g->graph) {
        cudaGraphLaunch(g->graph, g->queue.stream);
    } else {
        enqueue_update(g);
    }
    GpuProgress progress;
    download(g, &progress, g->progress, sizeof progress);
    const MildStatus status = finish(g, "update", error);
    if (status == MILD_OK) {
        *report = progress.report;
        ppo->iteration = progress.iteration;
        ppo->adam_steps = progress.adam_steps;
        ppo->learning_rate = progress.learning_rate;
        ppo->hash = (uint64_t)progress.hash;
    }
    return status;
}

static MildStatus learner_update(void *self, PpoReport *report, MildError *error) {
    const int before = enter(self);
    const MildStatus status = update(self, report, error);
    leave(before);
    return status;
}

/* ---- creation ---- */

static void learner_destroy(void *self) {
    GpuLearner *g = self;
    const int before = enter(g);
    if (g->pinned) {
        cudaHostUnregister(g->pinned);
    }
    if (g->graph) {
        cudaGraphExecDestroy(g->graph);
    }
    if (g->queue.blas) {
        cublasDestroy(g->queue.blas);
    }
    cudaFree(g->block);
    if (g->queue.stream) {
        cudaStreamDestroy(g->queue.stream);
    }
    leave(before);
    free(g->host_rows);
    free(g->padded);
    free(g);
}

/* Writes the name of the device as one line, or the reason why there is none. Returns whether there
 * is one of that number. */
static int describe(int device, char *text, size_t size) {
    int count = 0;
    struct cudaDeviceProp properties;
    cudaError_t code = cudaGetDeviceCount(&count);
    if (code == cudaSuccess && device < count) {
        code = cudaGetDeviceProperties(&properties, device);
    }
    if (code != cudaSuccess || device >= count) {
        snprintf(text, size, "no CUDA device %d: %s", device,
                 code         ? cudaGetErrorString(code)
                 : count == 0 ? "none is installed"
                              : "there are fewer");
        return 0;
    }
    snprintf(text, size, "%s, %.0f GiB, compute capability %d.%d", properties.name,
             (double)properties.totalGlobalMem / 1073741824.0, properties.major, properties.minor);
    return 1;
}

int gpu_device(char *text, size_t size) {
    return describe(0, text, size);
}

static MildStatus open_memory(GpuLearner *g, const char *device, MildError *error) {
    const double gibi = 1073741824.0;
    size_t available = 0, total = 0;
    g->bytes = layout(g, NULL);
    if (cudaMalloc(&g->block, g->bytes) == cudaSuccess) {
        layout(g, g->block);
        return MILD_OK;
    }
    cudaGetLastError();
    g->block = NULL;
    cudaMemGetInfo(&available, &total);
    return mild_fail(
        error, MILD_ERROR_MEMORY,
        "%s: %d robots x %d steps need %.1f GiB of its memory and %.1f are free, which "
        "is enough for %d robots; lower train.envs or ppo.steps",
        device, g->part.envs, g->batch.steps, (double)g->bytes / gibi, (double)available / gibi,
        robots_that_fit(g, available));
}

static MildStatus open_device(GpuLearner *g, MildError *error) {
    static const cublasComputeType_t arithmetic[PPO_MATMULS] = {
        CUBLAS_COMPUTE_32F, CUBLAS_COMPUTE_32F_FAST_TF32, CUBLAS_COMPUTE_32F};
    char device[512];
    if (!describe(g->device, device, sizeof device)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "%s; train.device = cpu needs none", device);
    }
    GpuQueue *q = &g->queue;
    q->arithmetic = arithmetic[g->ppo->def.matmul];
    q->fused = g->ppo->def.matmul == PPO_MATMUL_BF16 ? gpu_fused_processors(g->device) : 0;
    MildStatus status =
        check(cudaStreamCreateWithFlags(&q->stream, cudaStreamNonBlocking), device, error);
    if (!status) {
        status = open_memory(g, device, error);
    }
    if (!status &&
        (cublasCreate(&q->blas) != CUBLAS_STATUS_SUCCESS ||
         cublasSetStream(q->blas, q->stream) != CUBLAS_STATUS_SUCCESS ||
         cublasSetWorkspace(q->blas, g->workspace, WORKSPACE) != CUBLAS_STATUS_SUCCESS)) {
        status = mild_fail(error, MILD_ERROR_IO, "%s: cuBLAS does not start", device);
    }
    return status;
}

/* latent_row and which of all minibatches, which are the same in every epoch. */
static void fill_rows(GpuLearner *g) {
    const int minibatches = g->ppo->def.minibatches;
    const size_t samples = (size_t)g->batch.steps * (size_t)g->envs;
    for (int m = 0, first = 0; m < minibatches; m++) {
        int cut[PPO_SHARDS_MAX + 1], own[PPO_SHARDS_MAX + 1];
        order_cuts(g->part.all, g->batch.steps, g->part.envs, m, minibatches, cut);
        const int count = order_own_cuts(g->part, cut, own);
        ppo_latent_rows(own, cut[g->part.shard], g->host_rows + first);
        ppo_mirrored(g->ppo, own, g->host_rows + samples + first);
        first += count;
    }
    upload(g, g->latent_row, g->host_rows, samples * sizeof *g->host_rows);
    upload(g, g->which, g->host_rows + samples, samples * sizeof *g->host_rows);
}

/* Pins the rollout on the CPU, which makes its copies several times as fast. A failure only costs
 * speed. */
static void pin_rollout(GpuLearner *g) {
    Ppo *ppo = g->ppo;
    if (cudaHostRegister(ppo->batch_block, ppo->batch_bytes, cudaHostRegisterDefault) ==
        cudaSuccess) {
        g->pinned = ppo->batch_block;
    } else {
        cudaGetLastError();
    }
}

static MildStatus open_learner(GpuLearner *g, int resident, MildError *error) {
    Ppo *ppo = g->ppo;
    const PolicyDef *def = policy_def(ppo->policy);
    const size_t samples = (size_t)ppo->batch.steps * (size_t)ppo->batch.envs;
    g->network = gpu_network(&ppo->policy->network);
    gpu_muon_list(ppo, &g->network, &g->muon);
    set_sizes(g, ppo->part.envs);
    g->host_rows = calloc(2 * samples, sizeof *g->host_rows);
    g->padded = malloc((size_t)g->network.count * sizeof *g->padded);
    if (!g->host_rows || !g->padded) {
        return mild_fail(error, MILD_ERROR_MEMORY, "no memory for a learner on the GPU");
    }
    MildStatus status = open_device(g, error);
    if (status) {
        return status;
    }
    cudaMemsetAsync(g->block, 0, g->bytes, g->queue.stream);
    cudaMemsetAsync(g->batch.valid, 1, samples, g->queue.stream);
    fill_rows(g);
    if (ppo->mirror.observation_index) {
        const size_t count = (size_t)policy_newest(def) + (size_t)def->actions;
        upload(g, g->mirror_index, ppo->mirror_index, count * sizeof(int));
        upload(g, g->mirror_sign, ppo->mirror_sign, count * sizeof(float));
    }
    if (resident) {
        status = ppo_move_rollout(ppo, &g->batch, error);
    } else {
        pin_rollout(g);
    }
    gpu_enqueue_act(g, 0); /* loads the kernels of cuBLAS, which a capture of act could not */
    return status ? status : push(g, error);
}

MildStatus gpu_learner_attach(Ppo *ppo, const GpuLearnerDef *def, MildError *error) {
    GpuLearner *g = calloc(1, sizeof *g);
    if (!g) {
        return mild_fail(error, MILD_ERROR_MEMORY, "no memory for a learner on the GPU");
    }
    g->ppo = ppo;
    g->device = def->device;
    g->wanted_rows = def->rows;
    const int before = enter(g);
    const MildStatus status = open_learner(g, def->resident, error);
    leave(before);
    if (status) {
        learner_destroy(g);
        return status;
    }
    ppo_use(ppo, &(PpoBackend){g, learner_act, learner_update, learner_pull, learner_push,
                               learner_destroy});
    return MILD_OK;
}

/* ---- for the steps of the environments, tests and benches ---- */

static GpuLearner *learner_of(const Ppo *ppo) {
    return ppo->backend.destroy == learner_destroy ? ppo->backend.self : NULL;
}

MildStream gpu_learner_stream(const Ppo *ppo) {
    const GpuLearner *g = learner_of(ppo);
    return g ? g->queue.stream : NULL;
}

size_t gpu_learner_bytes(const Ppo *ppo) {
    const GpuLearner *g = learner_of(ppo);
    return g ? g->bytes : 0;
}

size_t gpu_learner_sum_bytes(const Ppo *ppo) {
    return (size_t)gpu_network(&ppo->policy->network).count * sizeof(float);
}

static MildStatus copy_rollout(const Ppo *ppo, void *to, const void *from, enum cudaMemcpyKind kind,
                               MildError *error) {
    GpuLearner *g = learner_of(ppo);
    PpoBatch shape = g->batch;
    const int before = enter(g);
    cudaMemcpyAsync(to ? to : g->rollout, from ? from : g->rollout,
                    ppo_carve_batch(&shape, &ppo->policy->network, NULL), kind, g->queue.stream);
    const MildStatus status = finish(g, "copy of the rollout", error);
    leave(before);
    return status;
}

MildStatus gpu_learner_write(Ppo *ppo, const void *block, MildError *error) {
    return copy_rollout(ppo, NULL, block, cudaMemcpyHostToDevice, error);
}

MildStatus gpu_learner_read(Ppo *ppo, void *block, MildError *error) {
    return copy_rollout(ppo, block, NULL, cudaMemcpyDeviceToHost, error);
}
