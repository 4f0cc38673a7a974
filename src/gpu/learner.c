#include "gpu/learner.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gpu/kernels.h"
#include "gpu/mlp.h"
#include "learn/ppo_gradient.h"

/* Rows go through the networks in chunks of at most this many. That fills a large GPU and bounds
 * the memory. */
#ifndef GPU_ROWS
#define GPU_ROWS 32768
#endif

_Static_assert(GPU_ACTIONS_MAX == NETWORK_ACTIONS_MAX, "one bound");

typedef struct {
    Ppo *ppo;
    GpuQueue queue;
    GpuWidths widths;
    int rows, minibatch; /* most rows of a chunk, most samples of a minibatch */
    void *block;         /* all device memory */
    float *parameters, *gradient;
    PpoBatch batch; /* the rollout on the device; flags and reward stay with the processor */
    LossChunk chunk;
    int *order, *latent_row, *which; /* [minibatch] samples, ppo_latent_rows, ppo_mirrored */
    int *mirror_index;               /* [observation + actions] */
    float *mirror_sign;
    double *sums; /* [sum_blocks][GPU_SUMS] */
    int sum_blocks;
    /* on the processor */
    int *host_rows; /* [2][minibatch]: latent_row, which, of the last size of minibatch */
    int known[PPO_SHARDS + 1]; /* cuts of that minibatch */
    int images;
    double *host_sums;
    void *pinned[3];
} GpuLearner;

/* ---- memory ---- */

static void *carve(char *block, size_t *used, size_t bytes) {
    void *at = block ? block + *used : NULL;
    *used += (bytes + 255) / 256 * 256;
    return at;
}

static int widest_layer(const Network *network) {
    int widest = 0;
    for (int i = 0; i < NETWORK_MLPS; i++) {
        const char *name;
        int width = mlp_widest(network_mlp(network, i, &name));
        widest = width > widest ? width : widest;
    }
    return widest;
}

/* Places all arrays in the device's block and returns its bytes. NULL: only counts them. */
static size_t layout(GpuLearner *g, char *block) {
    const Network *n = &g->ppo->policy->network;
    const PpoBatch *host = &g->ppo->batch;
    const size_t samples = (size_t)host->steps * (size_t)host->envs,
                 more = samples + (size_t)host->envs;
    const size_t mirror = (size_t)n->def.observation + (size_t)n->def.actions,
                 minibatch = (size_t)g->minibatch;
    const struct {
        float **at;
        size_t count;
    } areas[] = {
        {&g->parameters, (size_t)n->count},
        {&g->gradient, (size_t)n->count},
        {&g->queue.partial, (size_t)(GPU_SUM_SLICES * widest_layer(n))},
        {&g->mirror_sign, mirror},
        {&g->batch.history, samples * (size_t)n->history},
        {&g->batch.critic, more * (size_t)n->def.critic_input},
        {&g->batch.target, samples * (size_t)n->def.estimates},
        {&g->batch.frame, samples * (size_t)n->def.observation},
        {&g->batch.action, samples * (size_t)n->def.actions},
        {&g->batch.mean, samples * (size_t)n->def.actions},
        {&g->batch.log_prob, samples},
        {&g->batch.value, more},
        {&g->batch.advantage, samples},
        {&g->batch.returns, samples},
    };
    size_t used = 0;
    for (size_t i = 0; i < sizeof areas / sizeof *areas; i++) {
        *areas[i].at = carve(block, &used, areas[i].count * sizeof(float));
    }
    int **const indices[] = {&g->order, &g->latent_row, &g->which, &g->mirror_index};
    for (size_t i = 0; i < sizeof indices / sizeof *indices; i++) {
        *indices[i] = carve(block, &used, (i < 3 ? minibatch : mirror) * sizeof(int));
    }
    g->sums = carve(block, &used, (size_t)(g->sum_blocks * GPU_SUMS) * sizeof *g->sums);
    size_t floats = loss_carve(n, g->rows, g->rows, NULL, &g->chunk);
    float *chunk = carve(block, &used, floats * sizeof(float));
    loss_carve(n, g->rows, g->rows, chunk, &g->chunk);
    return used;
}

/* Pins an array that is copied often, which makes the copies several times as fast. A failure only
 * costs speed. */
static void pin(GpuLearner *g, int slot, void *memory, size_t bytes) {
    if (cudaHostRegister(memory, bytes, cudaHostRegisterDefault) == cudaSuccess) {
        g->pinned[slot] = memory;
    } else {
        cudaGetLastError();
    }
}

static void learner_destroy(void *self) {
    GpuLearner *g = self;
    if (!g) {
        return;
    }
    for (size_t i = 0; i < sizeof g->pinned / sizeof *g->pinned; i++) {
        if (g->pinned[i]) {
            cudaHostUnregister(g->pinned[i]);
        }
    }
    if (g->queue.blas) {
        cublasDestroy(g->queue.blas);
    }
    cudaFree(g->block);
    if (g->queue.stream) {
        cudaStreamDestroy(g->queue.stream);
    }
    free(g->host_rows);
    free(g->host_sums);
    free(g);
}

/* ---- traffic ---- */

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

static void upload_parameters(GpuLearner *g) {
    const Policy *policy = g->ppo->policy;
    upload(g, g->parameters, policy->parameters, (size_t)policy->network.count * sizeof(float));
}

/* Waits for all enqueued work and returns its first failure. */
static MildStatus finish(GpuLearner *g, const char *what, MildError *error) {
    cudaError_t launched = cudaGetLastError(), ran = cudaStreamSynchronize(g->queue.stream);
    MildStatus status = check(launched ? launched : ran, what, error);
    if (status == MILD_OK && g->queue.status) {
        status = mild_fail(error, MILD_ERROR_IO, "GPU: %s: %s", what,
                           cublasGetStatusString(g->queue.status));
    }
    return status;
}

/* ---- forward ---- */

/* As network_forward. */
static float *forward(GpuLearner *g, int rows, const float *history) {
    const Network *n = &g->ppo->policy->network;
    const NetworkOutputs *out = &g->chunk.outputs;
    GpuQueue *q = &g->queue;
    const float *heads =
        gpu_mlp_forward(q, &n->encoder, g->parameters, rows, history, n->history, &out->encoder);
    const float *theta =
        gpu_mlp_forward(q, &n->modulation, g->parameters, rows, heads + n->def.feet_velocity_offset,
                        n->heads, &out->modulation);
    gpu_actor_input(q->stream, g->widths, rows, history, heads, theta, out->actor_input);
    return gpu_mlp_forward(q, &n->actor, g->parameters, rows, out->actor_input, n->actor_input,
                           &out->actor);
}

static MildStatus learner_act(void *self, int t, MildError *error) {
    GpuLearner *g = self;
    const Network *n = &g->ppo->policy->network;
    const PpoBatch *b = &g->ppo->batch;
    const size_t history = (size_t)n->history, actions = (size_t)n->def.actions;
    upload_parameters(g);
    for (int first = 0; first < b->envs; first += g->rows) {
        const int rows = b->envs - first < g->rows ? b->envs - first : g->rows;
        const size_t row = (size_t)t * (size_t)b->envs + (size_t)first;
        upload(g, g->chunk.history, b->history + row * history,
               (size_t)rows * history * sizeof(float));
        const float *mean = forward(g, rows, g->chunk.history);
        download(g, b->mean + row * actions, mean, (size_t)rows * actions * sizeof(float));
    }
    return finish(g, "act", error);
}

/* Copies the rollout to the device, once per update. */
static void upload_batch(GpuLearner *g) {
    const PolicyDef *def = policy_def(g->ppo->policy);
    const PpoBatch *host = &g->ppo->batch, *b = &g->batch;
    const size_t samples = (size_t)host->steps * (size_t)host->envs,
                 more = samples + (size_t)host->envs;
    const struct {
        float *to;
        const float *from;
        size_t rows;
        int width;
    } areas[] = {
        {b->critic, host->critic, more, def->critic_input},
        {b->history, host->history, samples, g->widths.history},
        {b->target, host->target, samples, def->estimates},
        {b->frame, host->frame, samples, def->observation},
        {b->action, host->action, samples, def->actions},
        {b->mean, host->mean, samples, def->actions},
        {b->log_prob, host->log_prob, samples, 1},
    };
    for (size_t i = 0; i < sizeof areas / sizeof *areas; i++) {
        upload(g, areas[i].to, areas[i].from,
               areas[i].rows * (size_t)areas[i].width * sizeof(float));
    }
}

static MildStatus learner_values(void *self, MildError *error) {
    GpuLearner *g = self;
    const Network *n = &g->ppo->policy->network;
    const PpoBatch *host = &g->ppo->batch;
    const int count = (host->steps + 1) * host->envs, width = n->def.critic_input;
    upload_parameters(g);
    upload_batch(g);
    for (int first = 0; first < count; first += g->rows) {
        const int rows = count - first < g->rows ? count - first : g->rows;
        const float *value = gpu_mlp_forward(&g->queue, &n->critic, g->parameters, rows,
                                             g->batch.critic + (size_t)first * (size_t)width, width,
                                             &g->chunk.value);
        cudaMemcpyAsync(g->batch.value + first, value, (size_t)rows * sizeof *value,
                        cudaMemcpyDeviceToDevice, g->queue.stream);
    }
    download(g, host->value, g->batch.value, (size_t)count * sizeof(float));
    return finish(g, "values", error);
}

/* ---- gradient ---- */

/* What a chunk [at, at + rows) of the minibatch needs besides g->chunk. */
typedef struct {
    const LossContext *loss;
    uint64_t latent_key;
    const int *order, *latent_row, *which; /* device, of this chunk */
    int at;                                /* `which` counts from the minibatch's begin */
    float beta;
} ChunkJob;

static void gather(GpuLearner *g, const ChunkJob *job) {
    const PolicyDef *def = policy_def(g->ppo->policy);
    LossChunk *c = &g->chunk;
    const PpoBatch *b = &g->batch;
    const struct {
        float *to;
        const float *from;
        int width;
    } areas[] = {
        {c->history, b->history, g->widths.history},
        {c->estimate, b->target, def->estimates},
        {c->decoder_target, b->frame, def->observation},
        {c->action, b->action, def->actions},
        {c->old_mean, b->mean, def->actions},
        {c->old_log_prob, b->log_prob, 1},
        {c->advantage, b->advantage, 1},
        {c->critic, b->critic, def->critic_input},
        {c->old_value, b->value, 1},
        {c->returns, b->returns, 1},
    };
    cudaStream_t stream = g->queue.stream;
    for (size_t i = 0; i < sizeof areas / sizeof *areas; i++) {
        gpu_gather(stream, c->rows, areas[i].width, job->order, areas[i].from, areas[i].to);
    }
    if (c->mirrored > 0) {
        const GpuImages images = {c->mirrored, def->frames,     def->observation, job->at,
                                  job->which,  g->mirror_index, g->mirror_sign};
        gpu_mirror_history(stream, images, c->history,
                           c->history + (size_t)c->rows * (size_t)g->widths.history);
    }
    gpu_latent_noise(stream, c->rows, def->latent, job->latent_key, job->latent_row, c->noise);
}

/* As policy_loss and mirror_loss. The samples' gradients of log std are kept in a work area
 * until they are summed. */
static void action_losses(GpuLearner *g, const ChunkJob *job, const float *mean) {
    const LossContext *loss = job->loss;
    const PolicyDef *def = policy_def(g->ppo->policy);
    LossChunk *c = &g->chunk;
    const int actions = def->actions;
    const float share = (float)(1.0 - loss->def->epsilon) * loss->sample_weight;
    GpuSurrogate s = {.actions = actions,
                      .clip = (float)loss->def->clip,
                      .weight = share,
                      .entropy = share * (float)loss->def->entropy,
                      .action = c->action,
                      .old_mean = c->old_mean,
                      .old_log_prob = c->old_log_prob,
                      .advantage = c->advantage,
                      .mean = mean,
                      .d_mean = c->d_mean,
                      .d_log_std = c->work[0]};
    loss_surrogate_constants(loss, s.constant);
    gpu_surrogate(g->queue.stream, s, c->rows, g->sums);
    gpu_bias_backward(g->queue.stream, c->rows, actions, NULL, s.d_log_std, g->queue.partial,
                      job->beta, g->gradient + g->ppo->policy->network.log_std);
    if (c->mirrored > 0) {
        const size_t images = (size_t)c->rows * (size_t)actions;
        const GpuMirror m = {actions,
                             job->at,
                             job->which,
                             g->mirror_index + def->observation,
                             g->mirror_sign + def->observation,
                             2.0f * (float)loss->def->mirror_weight * loss->mirror_weight /
                                 (float)actions,
                             mean,
                             mean + images,
                             c->d_mean,
                             c->d_mean + images};
        gpu_mirror_loss(g->queue.stream, m, c->mirrored, g->sums);
    }
}

/* As loss_actor. */
static void actor_half(GpuLearner *g, const ChunkJob *job) {
    const LossContext *loss = job->loss;
    const Network *n = &g->ppo->policy->network;
    GpuQueue *q = &g->queue;
    LossChunk *c = &g->chunk;
    NetworkOutputs *out = &c->outputs;
    const int rows = c->rows, all = rows + c->mirrored, estimates = n->def.estimates;
    const float epsilon = (float)loss->def->epsilon * loss->sample_weight, beta = job->beta;
    const float *mean = forward(g, all, c->history), *heads = network_heads(n, out),
                *theta = network_theta(n, out);
    gpu_sample_latent(q->stream, g->widths, rows, heads, c->noise, c->spread, c->decoder_input);
    const float *decoded = gpu_mlp_forward(q, &n->decoder, g->parameters, rows, c->decoder_input,
                                           n->decoder_input, &c->decoder);

    action_losses(g, job, mean);
    gpu_reconstruction(q->stream, rows, n->def.observation,
                       2.0f * epsilon / (float)n->def.observation, decoded, c->decoder_target,
                       c->d_decoded, g->sums);

    gpu_mlp_backward(q, &n->decoder, g->parameters, rows, c->decoder_input, n->decoder_input,
                     &c->decoder, c->d_decoded, c->work, g->gradient, beta,
                     (MlpInputGradient){c->d_decoder_input, 0, n->decoder_input});
    gpu_mlp_backward(
        q, &n->actor, g->parameters, all, out->actor_input, n->actor_input, &out->actor, c->d_mean,
        c->work, g->gradient, beta,
        (MlpInputGradient){c->d_actor_input, n->def.observation, estimates + n->def.latent});
    gpu_modulation_backward(q->stream, g->widths, all, heads, theta, c->d_actor_input, c->d_heads,
                            c->d_theta);
    gpu_mlp_backward(q, &n->modulation, g->parameters, all, heads + n->def.feet_velocity_offset,
                     n->heads, &out->modulation, c->d_theta, c->work, g->gradient, beta,
                     (MlpInputGradient){c->d_feet, 0, n->def.feet_velocity_count});
    const GpuHeads h = {2.0f * epsilon, epsilon * (float)loss->def->kl_weight,
                        heads,          c->estimate,
                        c->spread,      c->noise,
                        c->d_feet,      c->d_decoder_input,
                        c->d_heads};
    gpu_heads_backward(q->stream, g->widths, h, rows, all, g->sums);
    gpu_mlp_backward(q, &n->encoder, g->parameters, all, c->history, n->history, &out->encoder,
                     c->d_heads, c->work, g->gradient, beta, (MlpInputGradient){0});
}

/* As loss_critic. */
static void critic_half(GpuLearner *g, const ChunkJob *job) {
    const LossContext *loss = job->loss;
    const PpoDef *def = loss->def;
    const Network *n = &g->ppo->policy->network;
    LossChunk *c = &g->chunk;
    const float weight =
        2.0f * (float)((1.0 - def->epsilon) * def->value_weight) * loss->sample_weight;
    const float *value = gpu_mlp_forward(&g->queue, &n->critic, g->parameters, c->rows, c->critic,
                                         n->def.critic_input, &c->value);
    gpu_value_loss(g->queue.stream, c->rows, def->clip_value, (float)def->clip, weight, value,
                   c->returns, c->old_value, c->d_value, g->sums);
    gpu_mlp_backward(&g->queue, &n->critic, g->parameters, c->rows, c->critic, n->def.critic_input,
                     &c->value, c->d_value, c->work, g->gradient, job->beta, (MlpInputGradient){0});
}

/* Uploads all that the chunks of a minibatch read. */
static void upload_minibatch(GpuLearner *g, const PpoMinibatch *minibatch) {
    const PpoBatch *host = &g->ppo->batch;
    const size_t all = (size_t)host->steps * (size_t)host->envs * sizeof(float),
                 indices = (size_t)minibatch->cut[PPO_SHARDS] * sizeof(int);
    if (memcmp(minibatch->cut, g->known, sizeof g->known) != 0) {
        ppo_latent_rows(minibatch->cut, g->host_rows);
        g->images = ppo_mirrored(g->ppo, minibatch->cut, g->host_rows + g->minibatch);
        memcpy(g->known, minibatch->cut, sizeof g->known);
        upload(g, g->latent_row, g->host_rows, indices);
        upload(g, g->which, g->host_rows + g->minibatch, (size_t)g->images * sizeof(int));
    }
    upload_parameters(g);
    upload(g, g->batch.advantage, host->advantage, all);
    upload(g, g->batch.returns, host->returns, all);
    upload(g, g->order, minibatch->samples, indices);
    cudaMemsetAsync(g->sums, 0, (size_t)(g->sum_blocks * GPU_SUMS) * sizeof *g->sums,
                    g->queue.stream);
}

/* Number of images whose sample comes before `end`; `which` ascends. */
static int images_before(const GpuLearner *g, int from, int end) {
    while (from < g->images && g->host_rows[g->minibatch + from] < end) {
        from++;
    }
    return from;
}

static void add_sums(const GpuLearner *g, LossSums *sums) {
    double total[GPU_SUMS] = {0.0};
    for (int i = 0; i < g->sum_blocks * GPU_SUMS; i++) {
        total[i % GPU_SUMS] += g->host_sums[i];
    }
    *sums = (LossSums){
        .surrogate = total[GPU_SUM_SURROGATE],
        .kl = total[GPU_SUM_KL],
        .clipped = total[GPU_SUM_CLIPPED],
        .reconstruction = total[GPU_SUM_RECONSTRUCTION],
        .vae_kl = total[GPU_SUM_VAE_KL],
        .estimate = {total[GPU_SUM_ESTIMATE], total[GPU_SUM_ESTIMATE + 1],
                     total[GPU_SUM_ESTIMATE + 2]},
        .mirror = total[GPU_SUM_MIRROR],
        .value = total[GPU_SUM_VALUE],
    };
}

static MildStatus learner_gradient(void *self, const LossContext *context,
                                   const PpoMinibatch *minibatch, float *gradient, LossSums *sums,
                                   MildError *error) {
    GpuLearner *g = self;
    const int count = minibatch->cut[PPO_SHARDS];
    const uint64_t latent_key = ppo_latent_key(g->ppo, minibatch->draw);
    upload_minibatch(g, minibatch);
    for (int at = 0, image = 0; at < count; at += g->rows) {
        g->chunk.rows = count - at < g->rows ? count - at : g->rows;
        const int next = images_before(g, image, at + g->chunk.rows);
        g->chunk.mirrored = next - image;
        const ChunkJob job = {
            context,          latent_key, g->order + at,        g->latent_row + at,
            g->which + image, at,         at == 0 ? 0.0f : 1.0f};
        gather(g, &job);
        actor_half(g, &job);
        critic_half(g, &job);
        image = next;
    }
    download(g, gradient, g->gradient, (size_t)g->ppo->policy->network.count * sizeof *gradient);
    download(g, g->host_sums, g->sums, (size_t)(g->sum_blocks * GPU_SUMS) * sizeof *g->sums);
    MildStatus status = finish(g, "gradient", error);
    add_sums(g, sums);
    return status;
}

/* ---- creation ---- */

int gpu_device(char *text, size_t size) {
    int count = 0;
    struct cudaDeviceProp properties;
    cudaError_t code = cudaGetDeviceCount(&count);
    if (code == cudaSuccess && count > 0) {
        code = cudaGetDeviceProperties(&properties, 0);
    }
    if (code != cudaSuccess || count <= 0) {
        snprintf(text, size, "no CUDA device: %s",
                 code ? cudaGetErrorString(code) : "none is installed");
        return 0;
    }
    snprintf(text, size, "%s, %.0f GiB, compute capability %d.%d", properties.name,
             (double)properties.totalGlobalMem / 1073741824.0, properties.major, properties.minor);
    return 1;
}

static void set_sizes(GpuLearner *g) {
    const Ppo *ppo = g->ppo;
    const PolicyDef *def = policy_def(ppo->policy);
    const int64_t samples = (int64_t)ppo->batch.steps * ppo->batch.envs,
                  all = samples + ppo->batch.envs;
    g->rows = all < GPU_ROWS ? (int)all : GPU_ROWS;
    g->minibatch = ppo_largest_minibatch(ppo);
    g->sum_blocks = gpu_blocks(2 * g->rows);
    g->widths = (GpuWidths){ppo->policy->network.history,
                            def->observation,
                            def->estimates,
                            def->latent,
                            def->modulation_per_dimension,
                            def->feet_velocity_offset,
                            def->feet_velocity_count,
                            def->actions};
}

static MildStatus open_device(GpuLearner *g, MildError *error) {
    char device[512];
    if (!gpu_device(device, sizeof device)) {
        return mild_fail(error, MILD_ERROR_ARGUMENT, "%s; train.device = cpu needs none", device);
    }
    const size_t bytes = layout(g, NULL);
    MildStatus status =
        check(cudaStreamCreateWithFlags(&g->queue.stream, cudaStreamNonBlocking), device, error);
    if (!status && cudaMalloc(&g->block, bytes) != cudaSuccess) {
        status = mild_fail(error, MILD_ERROR_MEMORY,
                           "%s: no %.1f GiB free; lower train.envs or ppo.steps", device,
                           (double)bytes / 1073741824.0);
    }
    if (!status && (cublasCreate(&g->queue.blas) != CUBLAS_STATUS_SUCCESS ||
                    cublasSetStream(g->queue.blas, g->queue.stream) != CUBLAS_STATUS_SUCCESS)) {
        status = mild_fail(error, MILD_ERROR_IO, "%s: cuBLAS does not start", device);
    }
    return status;
}

static MildStatus open_learner(GpuLearner *g, MildError *error) {
    Ppo *ppo = g->ppo;
    const Network *n = &ppo->policy->network;
    set_sizes(g);
    g->host_rows = malloc(2 * (size_t)g->minibatch * sizeof *g->host_rows);
    g->host_sums = malloc((size_t)(g->sum_blocks * GPU_SUMS) * sizeof *g->host_sums);
    if (!g->host_rows || !g->host_sums) {
        return mild_fail(error, MILD_ERROR_MEMORY, "no memory for a learner on the GPU");
    }
    MildStatus status = open_device(g, error);
    if (status) {
        return status;
    }
    layout(g, g->block);
    pin(g, 0, ppo->batch_block, ppo->batch_bytes);
    pin(g, 1, ppo->policy->parameters, (size_t)n->count * sizeof(float));
    pin(g, 2, ppo->gradient, (size_t)n->count * sizeof(float));
    if (ppo->mirror.observation_index) {
        const size_t count = (size_t)n->def.observation + (size_t)n->def.actions;
        upload(g, g->mirror_index, ppo->mirror_index, count * sizeof(int));
        upload(g, g->mirror_sign, ppo->mirror_sign, count * sizeof(float));
    }
    return finish(g, "start", error);
}

MildStatus gpu_learner_attach(Ppo *ppo, MildError *error) {
    GpuLearner *g = calloc(1, sizeof *g);
    if (!g) {
        return mild_fail(error, MILD_ERROR_MEMORY, "no memory for a learner on the GPU");
    }
    g->ppo = ppo;
    MildStatus status = open_learner(g, error);
    if (status) {
        learner_destroy(g);
        return status;
    }
    ppo_use(ppo, &(PpoBackend){g, learner_act, learner_values, learner_gradient, learner_destroy});
    return MILD_OK;
}
