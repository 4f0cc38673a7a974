#include "learn/ppo.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "learn/noise.h"
#include "learn/ppo_batch.h"
#include "learn/ppo_gradient.h"
#include "learn/ppo_private.h"
#include "learn/ppo_step.h"

size_t ppo_carve_batch(PpoBatch *b, const Network *n, void *block) {
    const size_t samples = (size_t)b->steps * (size_t)b->envs, more = samples + (size_t)b->envs;
    struct {
        float **at;
        size_t count;
    } areas[] = {
        {&b->history, more * (size_t)n->history},
        {&b->critic, more * (size_t)n->def.critic_input},
        {&b->target, more * (size_t)n->def.estimates},
        {&b->frame, more * (size_t)n->def.observation},
        {&b->action, samples * (size_t)n->def.actions},
        {&b->mean, samples * (size_t)n->def.actions},
        {&b->log_prob, samples},
        {&b->reward, samples},
        {&b->value, more},
        {&b->advantage, samples},
        {&b->returns, samples},
    };
    size_t used = 0;
    for (size_t i = 0; i < sizeof areas / sizeof *areas; i++) {
        *areas[i].at = mlp_carve(block, &used, areas[i].count);
    }
    used *= sizeof(float);
    uint8_t **flags[] = {&b->done, &b->timeout, &b->valid};
    for (size_t i = 0; i < sizeof flags / sizeof *flags; i++, used += samples) {
        *flags[i] = block ? (uint8_t *)block + used : NULL;
    }
    return used;
}

/* Allocates memory and counts it. Returns NULL when out of memory. */
static void *take(Ppo *ppo, size_t bytes) {
    bytes = (bytes + 63) / 64 * 64;
    ppo->bytes += bytes;
    return aligned_alloc(64, bytes);
}

static int take_mirror(Ppo *ppo, const PpoMirror *mirror) {
    const PolicyDef *def = policy_def(ppo->policy);
    const size_t newest = (size_t)policy_newest(def), actions = (size_t)def->actions;
    ppo->mirror_index = take(ppo, (newest + actions) * sizeof *ppo->mirror_index);
    ppo->mirror_sign = take(ppo, (newest + actions) * sizeof *ppo->mirror_sign);
    if (!ppo->mirror_index || !ppo->mirror_sign) {
        return 0;
    }
    memcpy(ppo->mirror_index, mirror->observation_index, newest * sizeof *ppo->mirror_index);
    memcpy(ppo->mirror_index + newest, mirror->action_index, actions * sizeof *ppo->mirror_index);
    memcpy(ppo->mirror_sign, mirror->observation_sign, newest * sizeof *ppo->mirror_sign);
    memcpy(ppo->mirror_sign + newest, mirror->action_sign, actions * sizeof *ppo->mirror_sign);
    ppo->mirror = (PpoMirror){ppo->mirror_index, ppo->mirror_sign, ppo->mirror_index + newest,
                              ppo->mirror_sign + newest};
    ppo->mirror_rows = (int)(ppo->def.mirror_share * PPO_CHUNK + 0.5);
    return 1;
}

static void clear_all(Ppo *ppo) {
    const Network *n = &ppo->policy->network;
    const size_t bytes = (size_t)n->count * sizeof(float);
    memset(ppo->batch_block, 0, ppo->batch_bytes);
    ppo_carve_batch(&ppo->batch, n, ppo->batch_block);
    memset(ppo->batch.valid, 1, (size_t)ppo->batch.steps * (size_t)ppo->batch.envs);
    ppo->start = ppo->batch;
    memset(ppo->first, 0, bytes);
    memset(ppo->second, 0, bytes);
}

static int take_all(Ppo *ppo, const PpoMirror *mirror) {
    const Network *n = &ppo->policy->network;
    const size_t count = (size_t)n->count,
                 samples = (size_t)ppo->batch.steps * (size_t)ppo->batch.envs;
    ppo->bytes = sizeof *ppo;
    if (mirror && mirror->observation_index && ppo->def.mirror_weight > 0.0 &&
        !take_mirror(ppo, mirror)) {
        return 0;
    }
    const int largest = order_largest(ppo->batch.steps, ppo->part, ppo->def.minibatches);
    LossChunk chunk;
    ppo->stride = (count + 15) / 16 * 16;
    const size_t loss = loss_carve(n, PPO_CHUNK, ppo->mirror_rows, NULL, &chunk),
                 muon = muon_work_floats(&ppo->muon);
    ppo->scratch_floats = loss > muon ? loss : muon;
    ppo->batch_bytes = ppo_carve_batch(&ppo->batch, n, NULL);
    ppo->batch_block = take(ppo, ppo->batch_bytes);
    ppo->gradient = take(ppo, (size_t)ppo->part.shards * ppo->stride * sizeof(float));
    ppo->first = take(ppo, count * sizeof(float));
    ppo->second = take(ppo, count * sizeof(float));
    ppo->scratch = take(ppo, (size_t)pool_threads(ppo->pool) * ppo->scratch_floats * sizeof(float));
    ppo->order = take(ppo, (size_t)largest * sizeof *ppo->order);
    ppo->substitute = take(ppo, samples * sizeof *ppo->substitute);
    if (ppo->def.sample_latent) {
        ppo->noise =
            take(ppo, (size_t)ppo->part.width * (size_t)n->def.latent * sizeof *ppo->noise);
        if (!ppo->noise) {
            return 0;
        }
    }
    if (ppo->def.average > 0.0) {
        ppo->average = policy_create(policy_def(ppo->policy), ppo->seed, NULL);
        ppo->bytes += count * sizeof(float);
        if (!ppo->average) {
            return 0;
        }
        memcpy(policy_parameters(ppo->average), ppo->policy->parameters, count * sizeof(float));
    }
    if (!ppo->batch_block || !ppo->gradient || !ppo->first || !ppo->second || !ppo->scratch ||
        !ppo->order || !ppo->substitute) {
        return 0;
    }
    clear_all(ppo);
    return 1;
}

static MildStatus check_mirror(const PolicyDef *def, const PpoMirror *mirror, MildError *error) {
    for (int i = 0; mirror && mirror->observation_index && i < policy_newest(def); i++) {
        const int first = i < def->observation ? 0 : def->observation;
        const int end = i < def->observation ? def->observation : policy_newest(def);
        if (mirror->observation_index[i] < first || mirror->observation_index[i] >= end) {
            return mild_fail(error, MILD_ERROR_RANGE, "mirror: observation %d maps to %d of %d", i,
                             mirror->observation_index[i], end);
        }
    }
    for (int i = 0; mirror && mirror->observation_index && i < def->actions; i++) {
        if (mirror->action_index[i] < 0 || mirror->action_index[i] >= def->actions) {
            return mild_fail(error, MILD_ERROR_RANGE, "mirror: action %d maps to %d of %d", i,
                             mirror->action_index[i], def->actions);
        }
    }
    return MILD_OK;
}

/* The decoder's shape is the target's. */
static MildStatus check_decoder(const PpoDef *def, const PolicyDef *policy, MildError *error) {
    const int frame = def->decoder_target != PPO_TARGET_GROUND,
              ground = !frame || def->decoder_target == PPO_TARGET_BOTH;
    if (policy->decoder_frame != frame || (policy->ground_count > 0) != ground) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "ppo.decoder_target does not fit the policy, whose decoder rebuilds %s "
                         "frame and %d parameters of the ground",
                         policy->decoder_frame ? "a" : "no", policy->ground_count);
    }
    if (!def->target_noise && policy->critic_input < policy->observation) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "ppo.target_noise = 0: the critic's %d numbers do not begin with a frame "
                         "of %d",
                         policy->critic_input, policy->observation);
    }
    return MILD_OK;
}

static MildStatus check_def(const PpoDef *def, int envs, MildError *error) {
    MildStatus status = mild_fields_check(ppo_fields, ppo_field_count, def, "ppo", error);
    if (status) {
        return status;
    }
    if (envs < 1 || (int64_t)envs * def->steps > 1 << 28) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "%d environments of %d steps: between 1 and 2^28 samples can be held",
                         envs, def->steps);
    }
    if ((def->shards & (def->shards - 1)) != 0) {
        return mild_fail(error, MILD_ERROR_RANGE, "ppo.shards = %d is no power of two",
                         def->shards);
    }
    if (def->learning_rate_min > def->learning_rate_max) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "ppo.learning_rate_min = %g is above ppo.learning_rate_max = %g",
                         def->learning_rate_min, def->learning_rate_max);
    }
    return MILD_OK;
}

Ppo *ppo_create(const PpoDef *def, Policy *policy, Pool *pool, const PpoMirror *mirror, int envs,
                uint64_t seed, MildError *error) {
    return ppo_create_part(def, policy, pool, mirror, envs, seed, NULL, error);
}

Ppo *ppo_create_part(const PpoDef *def, Policy *policy, Pool *pool, const PpoMirror *mirror,
                     int envs, uint64_t seed, Ranks *ranks, MildError *error) {
    _Static_assert(PPO_SHARDS_MAX % RANKS_MAX == 0, "a process has whole shards");
    if (check_def(def, envs, error) || check_decoder(def, policy_def(policy), error) ||
        check_mirror(policy_def(policy), mirror, error)) {
        return NULL;
    }
    if (def->shards < ranks_count(ranks)) {
        mild_fail(error, MILD_ERROR_RANGE,
                  "ppo.shards = %d is too few for %d processes; set it to %d", def->shards,
                  ranks_count(ranks), ranks_count(ranks));
        return NULL;
    }
    if (envs < ranks_count(ranks)) {
        mild_fail(error, MILD_ERROR_RANGE, "train.envs = %d is too few for %d processes", envs,
                  ranks_count(ranks));
        return NULL;
    }
    Ppo *ppo = calloc(1, sizeof *ppo);
    if (ppo) {
        ppo->def = *def;
        ppo->policy = policy;
        ppo->pool = pool;
        ppo->seed = seed;
        ppo->learning_rate = def->learning_rate;
        if (def->optimizer == PPO_OPTIMIZER_MUON) {
            ppo->muon = muon_matrices(&policy->network);
        }
        ppo->batch.steps = def->steps;
        ppo->ranks = ranks;
        ppo->part = order_part(def->shards, envs, ranks_number(ranks), ranks_count(ranks));
        ppo->batch.envs = ppo->part.width;
    }
    if (!ppo || !take_all(ppo, mirror)) {
        mild_fail(error, MILD_ERROR_MEMORY,
                  "no memory for a rollout of %d x %d samples; lower train.envs or ppo.steps", envs,
                  def->steps);
        ppo_destroy(ppo);
        return NULL;
    }
    return ppo;
}

void ppo_destroy(Ppo *ppo) {
    if (ppo) {
        if (ppo->backend.destroy) {
            ppo->backend.destroy(ppo->backend.self);
        }
        policy_destroy(ppo->average);
        free(ppo->mirror_index);
        free(ppo->mirror_sign);
        free(ppo->batch_block);
        free(ppo->gradient);
        free(ppo->first);
        free(ppo->second);
        free(ppo->scratch);
        free(ppo->noise);
        free(ppo->order);
        free(ppo->substitute);
        free(ppo);
    }
}

/* Copies the rows of time t of `from` to time 0 of `to`. */
static void copy_rows(const Network *n, const PpoBatch *to, const PpoBatch *from, int t) {
    const struct {
        float *to;
        const float *from;
        int width;
    } areas[] = {{to->history, from->history, n->history},
                 {to->critic, from->critic, n->def.critic_input},
                 {to->target, from->target, n->def.estimates},
                 {to->frame, from->frame, n->def.observation}};
    for (size_t i = 0; i < sizeof areas / sizeof *areas; i++) {
        const size_t floats = (size_t)from->envs * (size_t)areas[i].width;
        memcpy(areas[i].to, areas[i].from + (size_t)t * floats, floats * sizeof(float));
    }
}

MildStatus ppo_move_rollout(Ppo *ppo, const PpoBatch *device, MildError *error) {
    const Network *n = &ppo->policy->network;
    PpoBatch start = {.steps = 0, .envs = ppo->batch.envs};
    const size_t bytes = ppo_carve_batch(&start, n, NULL), before = ppo->bytes;
    void *block = take(ppo, bytes);
    if (!block) {
        ppo->bytes = before;
        return mild_fail(error, MILD_ERROR_MEMORY, "no memory for the observations of %d robots",
                         start.envs);
    }
    ppo_carve_batch(&start, n, block);
    copy_rows(n, &start, &ppo->start, 0);
    free(ppo->batch_block);
    ppo->bytes -= (ppo->batch_bytes + 63) / 64 * 64;
    ppo->batch_block = block;
    ppo->batch_bytes = bytes;
    ppo->start = start;
    ppo->batch = *device;
    ppo->resident = 1;
    return MILD_OK;
}

size_t ppo_batch_like(const Ppo *ppo, void *block, PpoBatch *batch) {
    batch->steps = ppo->batch.steps;
    batch->envs = ppo->batch.envs;
    return ppo_carve_batch(batch, &ppo->policy->network, block);
}

int ppo_is_resident(const Ppo *ppo) {
    return ppo->resident;
}

PpoBatch *ppo_batch(Ppo *ppo) {
    return &ppo->batch;
}

size_t ppo_bytes(const Ppo *ppo) {
    return ppo->bytes;
}

MildStatus ppo_pull(Ppo *ppo, MildError *error) {
    return ppo->backend.pull ? ppo->backend.pull(ppo->backend.self, error) : MILD_OK;
}

Policy *ppo_average(Ppo *ppo) {
    ppo_pull(ppo, ppo->error.status ? NULL : &ppo->error);
    return ppo->average ? ppo->average : ppo->policy;
}

uint64_t ppo_hash(const Ppo *ppo) {
    const uint32_t *words = (const uint32_t *)(const void *)ppo->policy->parameters;
    uint64_t hash = 0xcbf29ce484222325u;
    for (int64_t i = 0; !ppo->backend.update && i < ppo->policy->network.count; i++) {
        hash = (hash ^ words[i]) * 0x100000001b3u;
    }
    return ppo->backend.update ? ppo->hash : hash;
}

int64_t ppo_iteration(const Ppo *ppo) {
    return ppo->iteration;
}

int ppo_first_env(const Ppo *ppo) {
    return ppo->part.first;
}

void ppo_use(Ppo *ppo, const PpoBackend *backend) {
    ppo->backend = *backend;
}

MildStatus ppo_status(const Ppo *ppo, MildError *error) {
    return ppo->error.status ? mild_fail(error, ppo->error.status, "%s", ppo->error.text) : MILD_OK;
}

typedef struct {
    Ppo *ppo;
    int t;
    uint64_t key;
    const float *std;
} ActJob;

/* Samples actions around the means for the piece's environments. */
static void act_piece(void *context, int piece, int thread) {
    (void)thread;
    const ActJob *job = context;
    PpoBatch *b = &job->ppo->batch;
    const int actions = policy_def(job->ppo->policy)->actions;
    const int first = ppo_piece_begin(b->envs, piece), end = ppo_piece_begin(b->envs, piece + 1);
    const int64_t row = (int64_t)job->t * b->envs + first;
    float *mean = b->mean + row * actions, *action = b->action + row * actions;
    noise_normal(job->key, (int64_t)(job->ppo->part.first + first) * actions,
                 (end - first) * actions, action);
    for (int env = 0; env < end - first; env++, mean += actions, action += actions) {
        for (int j = 0; j < actions; j++) {
            action[j] = mean[j] + job->std[j] * action[j];
        }
        b->log_prob[row + env] = loss_log_prob(actions, action, mean, job->std);
    }
}

/* Rows of `times` time steps, cut between the strata, so that a row is multiplied among the same
 * neighbours whichever process has it: oneDNN's products can depend on them in the last bit. */
static PolicyRows rows_of(const Ppo *ppo, int times) {
    PolicyRows rows = {
        .bf16 = ppo->def.matmul == PPO_MATMUL_BF16, .blocks = times, .runs = ppo->part.shards};
    for (int s = 0; s < ppo->part.shards; s++) {
        const OrderStratum stratum = order_part_stratum(1, ppo->part, ppo->part.shard + s);
        rows.cut[s + 1] = stratum.first + stratum.width;
    }
    return rows;
}

void ppo_act(Ppo *ppo, int t) {
    const Network *n = &ppo->policy->network;
    PpoBatch *b = &ppo->batch;
    const int64_t first = (int64_t)t * b->envs;
    if (ppo->backend.act) {
        ppo->backend.act(ppo->backend.self, t, &ppo->error);
        return;
    }
    const PolicyRows rows = rows_of(ppo, 1);
    if (ppo->noise) {
        noise_normal(step_sampled_key(ppo->seed, ppo->iteration, t),
                     (int64_t)ppo->part.first * n->def.latent, b->envs * n->def.latent, ppo->noise);
    }
    policy_act_rows(ppo->policy, ppo->pool, &rows, b->history + first * n->history, ppo->noise,
                    b->mean + first * n->def.actions);
    ActJob job = {ppo, t, step_action_key(ppo->seed, ppo->iteration, t), policy_std(ppo->policy)};
    pool_run(ppo->pool, PPO_PIECES, act_piece, &job);
}

typedef struct {
    Ppo *ppo;
    int epoch, m;
    const int *cut;
} OrderJob;

static void order_shard(void *context, int piece, int thread) {
    (void)thread;
    const OrderJob *job = context;
    Ppo *ppo = job->ppo;
    const int shard = ppo->part.shard + piece, *cut = job->cut;
    const PpoBatch *b = &ppo->batch;
    const OrderStratum stratum = order_part_stratum(b->steps, ppo->part, shard);
    const Order order = order_make(stratum.count, ppo->seed, ppo->iteration, job->epoch, shard);
    const int minibatches = ppo->def.minibatches,
              end = order_begin(stratum.count, job->m + 1, minibatches);
    int *sample = ppo->order + (cut[shard] - cut[ppo->part.shard]);
    for (int place = order_begin(stratum.count, job->m, minibatches); place < end; place++) {
        const int k = order_at(&order, place);
        *sample++ = ppo->substitute[order_sample(stratum, b->envs, k)];
    }
}

/* Samples of minibatch m of the epoch. */
static PpoMinibatch draw_minibatch(Ppo *ppo, int epoch, int m) {
    const int minibatches = ppo->def.minibatches;
    PpoMinibatch minibatch = {.samples = ppo->order, .draw = (uint32_t)(epoch * minibatches + m)};
    order_cuts(ppo->part.all, ppo->batch.steps, ppo->part.envs, m, minibatches, minibatch.cut);
    OrderJob job = {ppo, epoch, m, minibatch.cut};
    pool_run(ppo->pool, ppo->part.shards, order_shard, &job);
    return minibatch;
}

static void bound_noise(Ppo *ppo) {
    const Network *n = &ppo->policy->network;
    const float ceiling = step_noise_ceiling(&ppo->def, ppo->iteration);
    for (int64_t i = n->log_std; i < n->count; i++) {
        ppo->policy->parameters[i] = fminf(ppo->policy->parameters[i], ceiling);
    }
}

static void average_weights(Ppo *ppo) {
    const float share = step_average(&ppo->def, ppo->iteration);
    const float *now = ppo->policy->parameters;
    float *mean = policy_parameters(ppo->average);
    for (int64_t i = 0; i < ppo->policy->network.count; i++) {
        mean[i] += share * (now[i] - mean[i]);
    }
}

/* Returns whether a step was taken. */
static int update_minibatch(Ppo *ppo, LossContext *context, const PpoMinibatch *minibatch,
                            PpoReport *report) {
    const int count = minibatch->cut[PPO_SHARDS_MAX],
              mirrored = ppo_mirrored(ppo, minibatch->cut, NULL);
    if (count == 0 || ppo->starved) {
        report->skipped += count > 0;
        return 0;
    }
    context->sample_weight = 1.0f / (float)count;
    context->mirror_weight = mirrored > 0 ? 1.0f / (float)mirrored : 0.0f;
    memcpy(context->std, policy_std(ppo->policy),
           (size_t)context->network->def.actions * sizeof *context->std);
    LossSums sums;
    double norm;
    ppo_gradient(ppo, context, minibatch, &sums, &norm);
    const double entropy = step_entropy(context->network->def.actions, context->std);
    if (!step_report(report, &sums, (double)context->sample_weight, (double)context->mirror_weight,
                     entropy, norm)) {
        report->skipped++;
        return 0;
    }
    ppo->learning_rate =
        step_learning_rate(&ppo->def, ppo->iteration, ppo->learning_rate, sums.kl / count);
    ppo_optimise(ppo, step_clip(&ppo->def, norm));
    return 1;
}

/* Writes the decoder's frames of the piece's environments: this one or its successor, from the
 * frames or from the critic's input, which begins with a frame without noise. */
static void frame_piece(void *context, int piece, int thread) {
    (void)thread;
    const Ppo *ppo = context;
    const PpoBatch *b = &ppo->batch;
    const PolicyDef *def = policy_def(ppo->policy);
    const int width = def->observation, stride = ppo->def.target_noise ? width : def->critic_input,
              is_next = step_frame_is_next(&ppo->def);
    const float *from = ppo->def.target_noise ? b->frame : b->critic;
    const int first = ppo_piece_begin(b->envs, piece), end = ppo_piece_begin(b->envs, piece + 1);
    for (int t = 0; t < b->steps; t++) {
        for (int env = first; env < end; env++) {
            const int64_t now = (int64_t)t * b->envs + env;
            const int64_t row = is_next && returns_has_next(b, t, now) ? now + b->envs : now;
            memmove(b->frame + now * width, from + row * stride, (size_t)width * sizeof *from);
        }
    }
}

static void update(Ppo *ppo, PpoReport *report) {
    const Network *n = &ppo->policy->network;
    PpoBatch *b = &ppo->batch;
    if (step_writes_frames(&ppo->def)) {
        pool_run(ppo->pool, PPO_PIECES, frame_piece, ppo);
    }
    const PolicyRows rows = rows_of(ppo, b->steps + 1);
    policy_value_rows(ppo->policy, ppo->pool, &rows, b->critic, b->value);
    ppo_returns(ppo, report);

    LossContext context = {.def = &ppo->def, .network = n, .parameters = ppo->policy->parameters};
    context.mirror = ppo->mirror.observation_index ? &ppo->mirror : NULL;
    memcpy(context.old_std, policy_std(ppo->policy),
           (size_t)n->def.actions * sizeof *context.old_std);
    int taken = 0;
    for (int epoch = 0; epoch < ppo->def.epochs; epoch++) {
        for (int m = 0; m < ppo->def.minibatches; m++) {
            const PpoMinibatch minibatch = draw_minibatch(ppo, epoch, m);
            taken += update_minibatch(ppo, &context, &minibatch, report);
        }
    }
    bound_noise(ppo);
    if (ppo->average) {
        average_weights(ppo);
    }
    step_finish_report(report, taken, n->def.actions, policy_std(ppo->policy), ppo->learning_rate);
    ppo->iteration++;
}

void ppo_update(Ppo *ppo, PpoReport *report) {
    *report = (PpoReport){0};
    if (ppo->backend.update) {
        ppo->backend.update(ppo->backend.self, report, &ppo->error);
    } else {
        update(ppo, report);
    }
    if (!ppo->resident) { /* the rows after the last step are the first of the next rollout */
        copy_rows(&ppo->policy->network, &ppo->batch, &ppo->batch, ppo->batch.steps);
    }
}
