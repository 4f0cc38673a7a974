#include "learn/policy.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "learn/policy_private.h"
#include "learn/product.h"

/* Rows go through the networks in chunks of this many, and chunks are dealt to this many pieces of
 * work, each with its own scratch: neither depends on the number of threads. */
#define POLICY_CHUNK 128
#define POLICY_SLOTS 16

static size_t carve_slot(const Network *network, float *block, NetworkOutputs *outputs,
                         MlpOutputs *critic) {
    size_t act = 0, value = 0;
    network_carve(network, POLICY_CHUNK, block, &act, outputs);
    mlp_carve_outputs(&network->critic, POLICY_CHUNK, block, &value, critic);
    return act > value ? act : value;
}

static void *aligned_floats(size_t count) {
    return aligned_alloc(64, (count * sizeof(float) + 63) / 64 * 64);
}

Policy *policy_create(const PolicyDef *def, uint64_t seed, MildError *error) {
    Network network;
    if (network_layout(&network, def, error)) {
        return NULL;
    }
    NetworkOutputs outputs;
    MlpOutputs critic;
    size_t slot_floats = carve_slot(&network, NULL, &outputs, &critic);
    Policy *policy = calloc(1, sizeof *policy);
    if (policy) {
        policy->network = network;
        policy->slot_floats = slot_floats;
        policy->parameters = aligned_floats((size_t)network.count);
        policy->std = aligned_floats((size_t)def->actions);
        policy->scratch = aligned_floats(POLICY_SLOTS * slot_floats);
    }
    if (!policy || !policy->parameters || !policy->std || !policy->scratch) {
        policy_destroy(policy);
        mild_fail(error, MILD_ERROR_MEMORY, "no memory for a policy of %lld parameters",
                  (long long)network.count);
        return NULL;
    }
    network_initialise(&policy->network, policy->parameters, seed);
    return policy;
}

void policy_destroy(Policy *policy) {
    if (policy) {
        free(policy->parameters);
        free(policy->std);
        free(policy->scratch);
        free(policy);
    }
}

const PolicyDef *policy_def(const Policy *policy) {
    return &policy->network.def;
}

int64_t policy_parameter_count(const Policy *policy) {
    return policy->network.count;
}

float *policy_parameters(Policy *policy) {
    return policy->parameters;
}

/* Bool: a has the layers of b, with `more` inputs besides. */
static int same_shape(const Mlp *a, const Mlp *b, int more) {
    int same = a->layers == b->layers && a->layer[0].in == b->layer[0].in + more;
    for (int l = 0; same && l < a->layers; l++) {
        same = a->layer[l].out == b->layer[l].out;
    }
    return same;
}

/* Takes a network into `to`, whose first layer has `more` inputs besides, from number `first` on:
 * their weights are 0. */
static void take_network(const Mlp *to, const Mlp *from, int first, int more, const float *source,
                         float *parameters) {
    const MlpLayer *head = &to->layer[0], *other = &from->layer[0];
    const MlpLayer *last = &to->layer[to->layers - 1];
    for (int row = 0; row < head->out; row++) {
        float *w = parameters + head->weight + (int64_t)row * head->in;
        const float *v = source + other->weight + (int64_t)row * other->in;
        memcpy(w, v, (size_t)first * sizeof *w);
        memset(w + first, 0, (size_t)more * sizeof *w);
        memcpy(w + first + more, v + first, (size_t)(other->in - first) * sizeof *w);
    }
    memcpy(parameters + head->bias, source + other->bias,
           (size_t)(last->bias + last->out - head->bias) * sizeof *parameters);
}

/* A scan that only the taker has: numbers of it in the inputs of a network, and the first. */
static int scan_inputs(const Policy *policy, const Policy *from, const Mlp *mlp, int *first) {
    const Network *own = &policy->network;
    const int is_actor = mlp == &own->actor;
    const int sees = is_actor || mlp == &own->encoder || mlp == &own->critic;
    const int more = sees && from->network.def.scan == 0 ? own->def.scan : 0;
    *first = is_actor ? own->def.observation : mlp->layer[0].in - more; /* the others: at the end */
    return more;
}

int policy_take_networks(Policy *policy, const Policy *from) {
    const Network *own = &policy->network, *other = &from->network;
    const char *name;
    int fits = own->def.actions == other->def.actions, first;
    for (int n = 0; n < NETWORK_MLPS; n++) {
        const Mlp *mlp = network_mlp(own, n, &name);
        const int more = scan_inputs(policy, from, mlp, &first);
        fits &= mlp == &own->decoder || same_shape(mlp, network_mlp(other, n, &name), more);
    }
    if (!fits) {
        return 0;
    }
    for (int n = 0; n < NETWORK_MLPS; n++) {
        const Mlp *to = network_mlp(own, n, &name), *source = network_mlp(other, n, &name);
        const int more = scan_inputs(policy, from, to, &first);
        if (same_shape(to, source, more)) {
            take_network(to, source, first, more, from->parameters, policy->parameters);
        }
    }
    if (own->def.scan == other->def.scan) { /* else there is something new to explore */
        memcpy(policy->parameters + own->log_std, from->parameters + other->log_std,
               (size_t)own->def.actions * sizeof(float));
    }
    network_hide_clock(own, policy->parameters);
    return 1;
}

const float *policy_std(const Policy *policy) {
    const float *log_std = policy->parameters + policy->network.log_std;
    for (int i = 0; i < policy->network.def.actions; i++) {
        policy->std[i] = expf(log_std[i]);
    }
    return policy->std;
}

typedef struct {
    Policy *policy;
    const PolicyRows *rows;
    int per_run; /* chunks of a run; the last ones of a short run are empty */
    int chunks, slots;
    const float *input;
    const float *noise; /* of z; NULL: none */
    float *actions, *values;
    PolicyInside inside;
    const PolicyInstead *instead;
} PolicyJob;

/* The first `width` numbers of each row, the rows `stride` apart; to: NULL, not wanted. */
static void copy_columns(const float *from, int stride, int width, int first, int rows, float *to) {
    for (int r = 0; to && r < rows; r++) {
        memcpy(to + (int64_t)(first + r) * width, from + (int64_t)r * stride,
               (size_t)width * sizeof *to);
    }
}

static void act_chunk(const PolicyJob *job, int first, int rows, NetworkOutputs *outputs) {
    const Network *network = &job->policy->network;
    const PolicyDef *def = &network->def;
    const PolicyInside *inside = &job->inside;
    outputs->noise = job->noise ? job->noise + (int64_t)first * def->latent : NULL;
    const float *mean = network_forward_instead(network, job->policy->parameters, rows,
                                                job->input + (int64_t)first * network->history,
                                                job->instead, outputs);
    const float *heads = network_heads(network, outputs);
    const int modulated = network->newest + def->estimates;
    // NOLINTNEXTLINE(clang-analyzer-core.NonNullParamChecker): one without values wants actions
    memcpy(job->actions + (int64_t)first * def->actions, mean,
           (size_t)rows * (size_t)def->actions * sizeof *mean);
    copy_columns(heads, network->heads, def->estimates, first, rows, inside->estimates);
    copy_columns(heads + def->estimates, network->heads, def->latent, first, rows, inside->latent);
    copy_columns(network_theta(network, outputs), network->theta, network->theta, first, rows,
                 inside->theta);
    copy_columns(outputs->actor_input + modulated, network->actor_input, def->latent, first, rows,
                 inside->modulated);
}

static void value_chunk(const PolicyJob *job, int first, int rows, const MlpOutputs *outputs) {
    const Network *network = &job->policy->network;
    int width = network->def.critic_input;
    const float *value = mlp_forward(&network->critic, job->policy->parameters, rows,
                                     job->input + (int64_t)first * width, width, outputs);
    memcpy(job->values + first, value, (size_t)rows * sizeof *value);
}

/* First row of a chunk, and how many. */
static int chunk_rows(const PolicyJob *job, int chunk, int *count) {
    const PolicyRows *rows = job->rows;
    const int run = chunk / job->per_run % rows->runs, block = chunk / job->per_run / rows->runs;
    const int first = rows->cut[run] + chunk % job->per_run * POLICY_CHUNK,
              left = rows->cut[run + 1] - first;
    *count = left < POLICY_CHUNK ? left : POLICY_CHUNK;
    return block * rows->cut[rows->runs] + first;
}

static void run_slot(void *context, int slot, int thread) {
    (void)thread;
    const PolicyJob *job = context;
    NetworkOutputs outputs;
    MlpOutputs critic;
    carve_slot(&job->policy->network,
               job->policy->scratch + (size_t)slot * job->policy->slot_floats, &outputs, &critic);
    int entered = product_enter(job->rows->bf16);
    for (int chunk = slot; chunk < job->chunks; chunk += job->slots) {
        int rows;
        const int first = chunk_rows(job, chunk, &rows);
        if (rows > 0 && job->values) {
            value_chunk(job, first, rows, &critic);
        } else if (rows > 0) {
            act_chunk(job, first, rows, &outputs);
        }
    }
    product_leave(entered);
}

static void run_job(PolicyJob *job, Pool *pool) {
    const PolicyRows *rows = job->rows;
    int longest = 0;
    for (int run = 0; run < rows->runs; run++) {
        const int length = rows->cut[run + 1] - rows->cut[run];
        longest = length > longest ? length : longest;
    }
    job->per_run = (longest + POLICY_CHUNK - 1) / POLICY_CHUNK;
    job->chunks = rows->blocks * rows->runs * job->per_run;
    job->slots = job->chunks < POLICY_SLOTS ? job->chunks : POLICY_SLOTS;
    if (pool) {
        pool_run(pool, job->slots, run_slot, job);
    } else {
        for (int slot = 0; slot < job->slots; slot++) {
            run_slot(job, slot, 0);
        }
    }
}

void policy_act_inside(Policy *policy, Pool *pool, int rows, const float *history,
                       const PolicyInstead *instead, float *actions, const PolicyInside *inside) {
    const PolicyRows all = {.blocks = 1, .runs = 1, .cut = {0, rows}};
    PolicyJob job = {.policy = policy,
                     .rows = &all,
                     .input = history,
                     .actions = actions,
                     .inside = *inside,
                     .instead = instead};
    run_job(&job, pool);
}

void policy_act(Policy *policy, Pool *pool, int rows, const float *history, float *actions,
                float *estimates, float *latent) {
    const PolicyInside inside = {.estimates = estimates, .modulated = latent};
    policy_act_inside(policy, pool, rows, history, NULL, actions, &inside);
}

int policy_theta(const Policy *policy) {
    return policy->network.theta;
}

void policy_act_rows(Policy *policy, Pool *pool, const PolicyRows *rows, const float *history,
                     const float *noise, float *actions) {
    PolicyJob job = {
        .policy = policy, .rows = rows, .input = history, .noise = noise, .actions = actions};
    run_job(&job, pool);
}

void policy_value_rows(Policy *policy, Pool *pool, const PolicyRows *rows, const float *critic,
                       float *values) {
    PolicyJob job = {.policy = policy, .rows = rows, .input = critic, .values = values};
    run_job(&job, pool);
}
