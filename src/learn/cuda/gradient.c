/* The networks over the rollout and over a minibatch: network.c and loss.c on the device. */
#include "learn/cuda/learner_private.h"
#include "learn/ppo_gradient.h"

static void *carve(char *block, size_t *used, size_t bytes) {
    void *at = block ? block + *used : NULL;
    *used += (bytes + 255) / 256 * 256;
    return at;
}

static GpuArray carve_array(int bf16, int rows, size_t width, char *block, size_t *used) {
    const size_t bytes = gpu_array_bytes(bf16, (size_t)rows * width);
    const GpuArray array = {carve(block, used, bytes), bf16};
    return array;
}

static void carve_outputs(const Mlp *mlp, int bf16, int rows, char *block, size_t *used,
                          GpuOutputs *outputs) {
    for (int l = 0; l < mlp->layers; l++) {
        outputs->y[l] =
            carve_array(bf16 && l < mlp->layers - 1, rows, (size_t)mlp->layer[l].out, block, used);
    }
}

size_t gpu_chunk_carve(const Network *n, const GpuWidths *w, int bf16, int rows, int mirrored,
                       char *block, GpuChunk *c) {
    size_t used = 0, widest = 0;
    const int all = rows + mirrored;
    for (int i = 0; i < NETWORK_MLPS; i++) {
        const char *name;
        const size_t width = (size_t)mlp_widest(network_mlp(n, i, &name));
        widest = width > widest ? width : widest;
    }
    const struct {
        GpuArray *at;
        int rows;
        size_t width;
    } arrays[] = {
        {&c->history, all, (size_t)w->history},
        {&c->critic, rows, (size_t)n->critic.layer[0].in},
        {&c->feet, all, (size_t)w->feet},
        {&c->actor_input, all, (size_t)w->actor_input},
        {&c->decoder_input, rows, (size_t)w->decoder_input},
        {&c->work[0], all, widest},
        {&c->work[1], all, widest},
    };
    const struct {
        float **at;
        int rows;
        size_t width;
    } floats[] = {
        {&c->noise, all, (size_t)w->latent},
        {&c->d_mean, all, (size_t)w->action},
        {&c->d_heads, all, (size_t)w->heads},
        {&c->d_theta, all, (size_t)w->theta},
        {&c->d_actor_input, all, (size_t)w->actor_input},
        {&c->d_feet, all, (size_t)w->feet},
        {&c->d_decoded, rows, (size_t)w->decoded},
        {&c->d_decoder_input, rows, (size_t)w->decoder_input},
        {&c->d_value, rows, (size_t)w->value},
    };
    for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++) {
        *arrays[i].at = carve_array(bf16, arrays[i].rows, arrays[i].width, block, &used);
    }
    for (size_t i = 0; i < sizeof floats / sizeof *floats; i++) {
        *floats[i].at = carve_array(0, floats[i].rows, floats[i].width, block, &used).at;
    }
    carve_outputs(&n->encoder, bf16, all, block, &used, &c->encoder);
    carve_outputs(&n->modulation, bf16, all, block, &used, &c->modulation);
    carve_outputs(&n->actor, bf16, all, block, &used, &c->actor);
    carve_outputs(&n->decoder, bf16, rows, block, &used, &c->decoder);
    carve_outputs(&n->critic, bf16, rows, block, &used, &c->value);
    return used;
}

void gpu_enqueue_weights(GpuLearner *g) {
    if (g->queue.weights.bf16) {
        gpu_round(g->queue.stream, g->network.count, g->parameters, g->queue.weights);
    }
}

/* ---- forward ---- */

static float *last_of(const Mlp *mlp, const GpuOutputs *outputs) {
    return outputs->y[mlp->layers - 1].at;
}

/* Of the actor's z; NULL: z = mu. */
static const float *actor_noise(const GpuLearner *g) {
    return g->ppo->def.sample_latent ? g->chunk.noise : NULL;
}

/* As network_forward, from chunk.history and, with ppo.sample_latent, chunk.noise. */
static const float *forward(GpuLearner *g, int rows) {
    const Network *n = &g->network;
    GpuChunk *c = &g->chunk;
    GpuQueue *q = &g->queue;
    const float *heads =
        gpu_mlp_forward(q, &n->encoder, g->parameters, rows, c->history, &c->encoder);
    const int newest = (n->def.frames - 1) * n->def.observation;
    gpu_feet_input(q->stream, g->widths, rows, newest, c->history, heads, c->feet);
    const float *theta =
        gpu_mlp_forward(q, &n->modulation, g->parameters, rows, c->feet, &c->modulation);
    gpu_actor_input(q->stream, g->widths, rows, newest, c->history, heads, actor_noise(g), theta,
                    c->actor_input);
    return gpu_mlp_forward(q, &n->actor, g->parameters, rows, c->actor_input, &c->actor);
}

void gpu_enqueue_act(GpuLearner *g, int t) {
    const Network *n = &g->network;
    const int width = policy_history(&n->def);
    for (int first = 0; first < g->envs; first += g->rows) {
        const int rows = g->envs - first < g->rows ? g->envs - first : g->rows;
        const size_t row = (size_t)t * (size_t)g->envs + (size_t)first;
        gpu_gather(g->queue.stream, rows, width, n->history, NULL,
                   g->batch.history + row * (size_t)width, g->chunk.history);
        if (g->ppo->def.sample_latent) {
            const GpuSampled sampled = {.rows = rows,
                                        .latent = n->def.latent,
                                        .envs = g->envs,
                                        .number = g->part.first,
                                        .first = (int)row};
            gpu_sampled_noise(g->queue.stream, sampled, g->progress, g->chunk.noise);
        }
        const float *mean = forward(g, rows);
        const GpuActions actions = {.t = t,
                                    .first = first,
                                    .number = g->part.first,
                                    .rows = rows,
                                    .actions = n->def.actions,
                                    .pitch = g->widths.action,
                                    .log_std = g->parameters + n->log_std,
                                    .mean = mean};
        gpu_sample_actions(g->queue.stream, actions, g->batch, g->progress);
    }
}

void gpu_enqueue_values(GpuLearner *g) {
    const Network *n = &g->network;
    const int count = (g->batch.steps + 1) * g->envs, width = n->def.critic_input;
    for (int first = 0; first < count; first += g->rows) {
        const int rows = count - first < g->rows ? count - first : g->rows;
        gpu_gather(g->queue.stream, rows, width, n->critic.layer[0].in, NULL,
                   g->batch.critic + (size_t)first * (size_t)width, g->chunk.critic);
        const float *value = gpu_mlp_forward(&g->queue, &n->critic, g->parameters, rows,
                                             g->chunk.critic, &g->chunk.value);
        gpu_take_values(g->queue.stream, rows, g->widths.value, value, g->batch.value + first);
    }
}

/* ---- gradient ---- */

/* Samples at .. at + chunk.rows - 1 of the minibatch. */
typedef struct {
    const int *order, *latent_row, *which; /* on the device, of this chunk */
    int at;                                /* `which` counts from the minibatch's begin */
    float sample_weight, mirror_weight;    /* see LossContext */
    float beta;
} ChunkJob;

static void gather(GpuLearner *g, const ChunkJob *job) {
    const Network *n = &g->network;
    GpuChunk *c = &g->chunk;
    cudaStream_t stream = g->queue.stream;
    gpu_gather(stream, c->rows, policy_history(&n->def), n->history, job->order, g->batch.history,
               c->history);
    gpu_gather(stream, c->rows, n->def.critic_input, n->critic.layer[0].in, job->order,
               g->batch.critic, c->critic);
    if (c->mirrored > 0) {
        const GpuImages images = {.images = c->mirrored,
                                  .frames = n->def.frames,
                                  .observation = n->def.observation,
                                  .scan = n->def.scan,
                                  .pitch = n->history,
                                  .first = job->at,
                                  .order = job->order,
                                  .which = job->which,
                                  .index = g->mirror_index,
                                  .sign = g->mirror_sign};
        gpu_mirror_history(stream, images, g->batch.history,
                           gpu_array_from(c->history, (size_t)c->rows * (size_t)n->history));
    }
    if (g->ppo->def.sample_latent) {
        const GpuSampled sampled = {.rows = c->rows,
                                    .images = c->mirrored,
                                    .latent = n->def.latent,
                                    .envs = g->envs,
                                    .number = g->part.first,
                                    .at = job->at,
                                    .order = job->order,
                                    .which = job->which};
        gpu_sampled_noise(stream, sampled, g->progress, c->noise);
        return;
    }
    gpu_latent_noise(stream, c->rows, n->def.latent, &g->progress->latent_key, job->latent_row,
                     c->noise);
}

/* As policy_loss and mirror_loss. */
static void action_losses(GpuLearner *g, const ChunkJob *job, const float *mean) {
    const PpoDef *def = &g->ppo->def;
    const int actions = g->network.def.actions, pitch = g->widths.action;
    GpuChunk *c = &g->chunk;
    const float share = (float)(1.0 - def->epsilon) * job->sample_weight;
    const GpuSurrogate s = {.actions = actions,
                            .pitch = pitch,
                            .constant = g->progress->constant,
                            .clip = (float)def->clip,
                            .weight = share,
                            .entropy = share * (float)def->entropy,
                            .order = job->order,
                            .action = g->batch.action,
                            .old_mean = g->batch.mean,
                            .old_log_prob = g->batch.log_prob,
                            .advantage = g->batch.advantage,
                            .mean = mean,
                            .d_mean = c->d_mean};
    const int slices =
        gpu_surrogate(g->queue.stream, s, c->rows, g->sums, gpu_columns_next(&g->queue));
    gpu_columns_add(&g->queue, pitch, slices, pitch, g->network.log_std);
    if (c->mirrored > 0) {
        const size_t images = (size_t)c->rows * (size_t)pitch;
        const int newest = g->network.newest;
        const GpuMirror m = {.actions = actions,
                             .pitch = pitch,
                             .first = job->at,
                             .which = job->which,
                             .index = g->mirror_index + newest,
                             .sign = g->mirror_sign + newest,
                             .weight = 2.0f * (float)def->mirror_weight * job->mirror_weight /
                                       (float)actions,
                             .mean = mean,
                             .image = mean + images,
                             .d_mean = c->d_mean,
                             .d_image = c->d_mean + images};
        gpu_mirror_loss(g->queue.stream, m, c->mirrored, g->sums);
    }
}

/* As loss_actor. */
static void actor_half(GpuLearner *g, const ChunkJob *job) {
    const PpoDef *def = &g->ppo->def;
    const Network *n = &g->network;
    const GpuWidths w = g->widths;
    GpuQueue *q = &g->queue;
    GpuChunk *c = &g->chunk;
    const int rows = c->rows, all = rows + c->mirrored;
    const float epsilon = (float)def->epsilon * job->sample_weight, beta = job->beta;
    const float *mean = forward(g, all), *heads = last_of(&n->encoder, &c->encoder),
                *theta = last_of(&n->modulation, &c->modulation);
    gpu_sample_latent(q->stream, w, rows, heads, c->noise, c->decoder_input);
    const float *decoded =
        gpu_mlp_forward(q, &n->decoder, g->parameters, rows, c->decoder_input, &c->decoder);

    action_losses(g, job, mean);
    gpu_reconstruction(q->stream, w, rows, 2.0f * epsilon, job->order, g->batch.frame,
                       g->batch.critic, decoded, c->d_decoded, g->sums);

    gpu_mlp_backward(q, &n->decoder, rows, c->decoder_input, &c->decoder, c->d_decoded, c->work,
                     g->gradient, beta, c->d_decoder_input);
    gpu_mlp_backward(q, &n->actor, all, c->actor_input, &c->actor, c->d_mean, c->work, g->gradient,
                     beta, c->d_actor_input);
    gpu_modulation_backward(q->stream, w, all, heads, actor_noise(g), c->d_actor_input, c->d_theta);
    gpu_mlp_backward(q, &n->modulation, all, c->feet, &c->modulation, c->d_theta, c->work,
                     g->gradient, beta, c->d_feet);
    const GpuHeads h = {.estimate_weight = 2.0f * epsilon,
                        .latent_weight = epsilon * (float)def->kl_weight,
                        .free_bits = (float)def->free_bits,
                        .sampled = def->sample_latent,
                        .order = job->order,
                        .target = g->batch.target,
                        .heads = heads,
                        .noise = c->noise,
                        .theta = theta,
                        .d_input = c->d_actor_input,
                        .d_feet = c->d_feet,
                        .d_decoder_input = c->d_decoder_input,
                        .d_heads = c->d_heads};
    gpu_heads_backward(q->stream, w, h, rows, all, g->sums);
    gpu_mlp_backward(q, &n->encoder, all, c->history, &c->encoder, c->d_heads, c->work, g->gradient,
                     beta, NULL);
}

/* As loss_critic. */
static void critic_half(GpuLearner *g, const ChunkJob *job) {
    const PpoDef *def = &g->ppo->def;
    const Network *n = &g->network;
    GpuChunk *c = &g->chunk;
    const GpuValue v = {
        .pitch = g->widths.value,
        .clip_value = def->clip_value,
        .clip = (float)def->clip,
        .weight = 2.0f * (float)((1.0 - def->epsilon) * def->value_weight) * job->sample_weight,
        .order = job->order,
        .returns = g->batch.returns,
        .old_value = g->batch.value,
        .value =
            gpu_mlp_forward(&g->queue, &n->critic, g->parameters, c->rows, c->critic, &c->value),
        .d = c->d_value};
    gpu_value_loss(g->queue.stream, v, c->rows, g->sums);
    gpu_mlp_backward(&g->queue, &n->critic, c->rows, c->critic, &c->value, c->d_value, c->work,
                     g->gradient, job->beta, NULL);
}

/* Number of images from `from` on whose sample comes before `end`; `which` ascends. */
static int images_before(const int *which, int from, int images, int end) {
    int next = from;
    while (next < images && which[next] < end) {
        next++;
    }
    return next - from;
}

/* As network_hide_clock, in the gradient. */
static void hide_clock(GpuLearner *g) {
    const Network *n = &g->network;
    const MlpLayer *encoder = &n->encoder.layer[0], *actor = &n->actor.layer[0];
    if (!n->def.actor_phase) {
        gpu_hide_clock(g->queue.stream, encoder->out, encoder->in, n->def.frames,
                       n->def.observation, g->gradient + encoder->weight);
        gpu_hide_clock(g->queue.stream, actor->out, actor->in, 1, n->def.observation,
                       g->gradient + actor->weight);
    }
}

void gpu_enqueue_gradient(GpuLearner *g, const GpuMinibatch *minibatch) {
    const int count = minibatch->cut[PPO_SHARDS_MAX], first = minibatch->first,
              images = ppo_mirrored(g->ppo, minibatch->cut, NULL);
    const int *which = g->host_rows + (size_t)g->batch.steps * (size_t)g->envs + first;
    if (count == 0) { /* all samples are other processes' */
        cudaMemsetAsync(g->gradient, 0, (size_t)g->network.count * sizeof *g->gradient,
                        g->queue.stream);
    }
    cudaMemsetAsync(g->sums, 0, (size_t)(g->sum_blocks * GPU_SUMS) * sizeof *g->sums,
                    g->queue.stream);
    for (int at = 0, image = 0; at < count; at += g->rows) {
        g->chunk.rows = count - at < g->rows ? count - at : g->rows;
        g->chunk.mirrored = images_before(which, image, images, at + g->chunk.rows);
        const ChunkJob job = {.order = g->order + at,
                              .latent_row = g->latent_row + first + at,
                              .which = g->which + first + image,
                              .at = at,
                              .sample_weight = 1.0f / (float)minibatch->samples,
                              .mirror_weight =
                                  minibatch->images > 0 ? 1.0f / (float)minibatch->images : 0.0f,
                              .beta = at == 0 ? 0.0f : 1.0f};
        GpuQueue *q = &g->queue;
        q->columns.count = 0;
        gather(g, &job);
        actor_half(g, &job);
        critic_half(g, &job);
        gpu_add_columns(q->stream, q->columns, q->partial, job.beta, g->gradient);
        image += g->chunk.mirrored;
    }
    hide_clock(g);
}
