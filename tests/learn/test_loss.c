/* The joint loss and its gradient: against the loss written down a second time in double precision,
 * and its central differences. */
#include "check.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "learn/loss.h"
#include "learn/loss_sample.h"
#include "learn/product.h"

#define ROWS 40
#define MIRRORED 20

static PpoDef reference_def(void) {
    PpoDef def = ppo_def_default();
    def.clip = 0.2;
    def.entropy = 0.01;
    def.value_weight = 0.7;
    def.epsilon = 0.3;
    def.kl_weight = 0.05;
    def.mirror_weight = 0.9;
    return def;
}

typedef struct {
    PpoDef def;
    Network network;
    LossContext context;
    LossChunk chunk;
    LossSums sums;
    PpoMirror mirror;
    float *parameters, *gradient, *block;
} Case;

static void case_open(Case *c, PolicyDef policy_def) {
    MildError error = {0};
    memset(c, 0, sizeof *c);
    c->def = reference_def();
    c->mirror = small_mirror();
    assert_int_equal(network_layout(&c->network, &policy_def, &error), MILD_OK);
    c->parameters = calloc((size_t)c->network.count, sizeof(float));
    c->gradient = calloc((size_t)c->network.count, sizeof(float));
    c->block =
        aligned_alloc(64, loss_carve(&c->network, ROWS, MIRRORED, NULL, &c->chunk) * sizeof(float));
    assert_true(c->parameters && c->gradient && c->block);
    loss_carve(&c->network, ROWS, MIRRORED, c->block, &c->chunk);
    c->chunk.rows = ROWS;
    c->chunk.mirrored = MIRRORED;
    c->context = (LossContext){.def = &c->def,
                               .network = &c->network,
                               .mirror = &c->mirror,
                               .parameters = c->parameters,
                               .sample_weight = 1.0f / ROWS,
                               .mirror_weight = 1.0f / MIRRORED};
}

static void case_close(Case *c) {
    free(c->parameters);
    free(c->gradient);
    free(c->block);
}

/* Gradient left by an earlier minibatch must not show: it starts as NaN. */
static void case_run(Case *c) {
    const int entered = product_enter(0);
    for (int r = 0; r < MIRRORED; r++) {
        loss_mirror_row(&c->context, &c->chunk, r, ROWS + r);
    }
    for (int j = 0; j < c->network.def.actions; j++) {
        c->context.std[j] = expf(c->parameters[c->network.log_std + j]);
    }
    for (int64_t i = 0; i < c->network.count; i++) {
        c->gradient[i] = NAN;
    }
    c->sums = (LossSums){0};
    loss_actor(&c->context, &c->chunk, c->gradient, 0.0f, &c->sums);
    loss_critic(&c->context, &c->chunk, c->gradient, 0.0f, &c->sums);
    product_leave(entered);
}

/* Within a tolerance of 1, or of the reference where that is more. */
static void assert_near(const char *what, double ours, double theirs, double tolerance) {
    expect_near(what, ours, theirs, tolerance * fmax(1.0, fabs(theirs)));
}

/* ---- the loss in double, straight from its formulas ---- */

/* Numbers that encoder and actor see: of frames that end with the clock, with 0 in its place if
 * they are not to see it, and of the scan behind them. */
static void seen_double(const PolicyDef *d, const double *frames, int count, double *seen) {
    for (int i = 0; i < count * d->observation + d->scan; i++) {
        const int is_clock = i < count * d->observation && i % d->observation >= d->observation - 2;
        seen[i] = is_clock && !d->actor_phase ? 0.0 : frames[i];
    }
}

/* noise: of the actor's z; NULL: z = mu. */
static void act_double(const Network *n, const double *p, const double *history, const float *noise,
                       double *heads, double *mean) {
    const PolicyDef *d = &n->def;
    const int from = d->feet_velocity_offset, newest = d->observation + d->scan;
    const double *frame = history + n->history - newest;
    double theta[64], input[64], feet[64];
    seen_double(d, history, d->frames, input);
    mlp_double(&n->encoder, p, input, heads);
    if (d->modulation_input == POLICY_INPUT_FEET_PHASE) { /* all estimates behind the base's */
        memcpy(feet, heads + from, (size_t)(d->estimates - from) * sizeof *feet);
        memcpy(feet + d->estimates - from, frame + d->observation - 2, 2 * sizeof *feet);
    } else {
        memcpy(feet, heads + from, (size_t)d->feet_velocity_count * sizeof *feet);
    }
    mlp_double(&n->modulation, p, feet, theta);
    seen_double(d, frame, 1, input);
    memcpy(input + newest, heads, (size_t)d->estimates * sizeof *input);
    for (int j = 0; j < d->latent; j++) {
        int a = d->modulation_per_dimension ? j : 0,
            b = d->modulation_per_dimension ? d->latent + j : 1;
        const double spread = exp(0.5 * heads[d->estimates + d->latent + j]),
                     z = heads[d->estimates + j] + (noise ? spread * (double)noise[j] : 0.0);
        input[newest + d->estimates + j] = theta[a] * z + theta[b];
    }
    mlp_double(&n->actor, p, input, mean);
}

/* Returns what sample r adds to the loss, and adds its parts to the sums. */
static double regression_double(const Case *c, const double *p, const double *heads, int r,
                                LossSums *sums) {
    const Network *n = &c->network;
    const PolicyDef *d = &n->def;
    double input[64], decoded[64], loss = 0.0;
    const int ends[] = {0, d->feet_velocity_offset,
                        d->feet_velocity_offset + d->feet_velocity_count, d->estimates};
    for (int j = 0; j < d->latent; j++) {
        double mu = heads[d->estimates + j], logvar = heads[d->estimates + d->latent + j];
        input[j] = mu + exp(0.5 * logvar) * (double)c->chunk.noise[r * d->latent + j];
        const double kl = -0.5 * (1.0 + logvar - mu * mu - exp(logvar));
        loss += c->def.kl_weight * fmax(kl, c->def.free_bits);
        sums->vae_kl += kl;
    }
    memcpy(input + d->latent, heads, (size_t)d->estimates * sizeof *input);
    mlp_double(&n->decoder, p, input, decoded);
    const int frame = d->decoder_frame ? d->observation : 0, width = frame + d->ground_count;
    for (int j = 0; j < width; j++) {
        const double square = pow(decoded[j] - (double)c->chunk.decoder_target[r * width + j], 2);
        sums->reconstruction += square / (j < frame ? frame : d->ground_count);
        loss += square / (j < frame ? frame : d->ground_count);
    }
    for (int g = 0; g < 3; g++) {
        for (int j = ends[g]; j < ends[g + 1]; j++) {
            const double square =
                pow(heads[j] - (double)c->chunk.estimate[r * d->estimates + j], 2);
            sums->estimate[g] += square / (ends[g + 1] - ends[g]);
            loss += square / (ends[g + 1] - ends[g]);
        }
    }
    return loss;
}

static double policy_double(const Case *c, const double *p, const double *mean, int r,
                            LossSums *sums) {
    const Network *n = &c->network;
    const int actions = n->def.actions;
    double log_prob = 0.0, entropy = 0.0;
    for (int j = 0; j < actions; j++) {
        double log_std = p[n->log_std + j], old = (double)c->context.old_std[j],
               t = ((double)c->chunk.action[r * actions + j] - mean[j]) / exp(log_std),
               shift = (double)c->chunk.old_mean[r * actions + j] - mean[j];
        sums->kl += log_std - log(old) - 0.5 + 0.5 * (old * old + shift * shift) / exp(2 * log_std);
        log_prob -= 0.5 * t * t + log_std + 0.5 * log(2.0 * 3.14159265358979323846);
        entropy += log_std + 0.5 + 0.5 * log(2.0 * 3.14159265358979323846);
    }
    double ratio = exp(log_prob - (double)c->chunk.old_log_prob[r]),
           advantage = c->chunk.advantage[r];
    double held = fmin(fmax(ratio, 1.0 - c->def.clip), 1.0 + c->def.clip);
    double critic[64], value;
    for (int i = 0; i < n->def.critic_input; i++) {
        critic[i] = c->chunk.critic[r * n->def.critic_input + i];
    }
    mlp_double(&n->critic, p, critic, &value);
    double old = c->chunk.old_value[r], returns = c->chunk.returns[r];
    double held_value = old + fmin(fmax(value - old, -c->def.clip), c->def.clip);
    double value_loss = pow(value - returns, 2);
    value_loss = c->def.clip_value ? fmax(value_loss, pow(held_value - returns, 2)) : value_loss;
    const double surrogate = -fmin(ratio * advantage, held * advantage);
    sums->surrogate += surrogate;
    sums->clipped += ratio != held;
    sums->value += value_loss;
    return surrogate - c->def.entropy * entropy + c->def.value_weight * value_loss;
}

static double loss_double(const Case *c, const double *p, LossSums *sums) {
    const Network *n = &c->network;
    const PolicyDef *d = &n->def;
    double loss = 0.0;
    *sums = (LossSums){0};
    for (int r = 0; r < ROWS; r++) {
        double history[64], image[64], heads[64], mean[8], turned[8];
        for (int i = 0; i < n->history; i++) {
            const int last = (d->frames - 1) * d->observation; /* and the scan */
            const int f = i < last ? i / d->observation * d->observation : last, k = i - f;
            history[i] = c->chunk.history[r * n->history + i];
            image[i] =
                (double)c->mirror.observation_sign[k] *
                (double)c->chunk.history[r * n->history + f + c->mirror.observation_index[k]];
        }
        const float *noise = c->chunk.outputs.noise ? c->chunk.noise + r * d->latent : NULL;
        act_double(n, p, history, noise, heads, mean);
        loss += c->def.epsilon * regression_double(c, p, heads, r, sums) / ROWS;
        loss += (1.0 - c->def.epsilon) * policy_double(c, p, mean, r, sums) / ROWS;
        noise = noise && r < MIRRORED ? noise + ROWS * d->latent : noise;
        act_double(n, p, image, noise, heads, turned);
        for (int j = 0; r < MIRRORED && j < d->actions; j++) {
            const double gap =
                mean[j] - (double)c->mirror.action_sign[j] * turned[c->mirror.action_index[j]];
            sums->mirror += gap * gap / d->actions;
            loss += c->def.mirror_weight * gap * gap / (MIRRORED * d->actions);
        }
    }
    return loss;
}

/* The weights of the clock as a network without it has them. */
static void clear_clock(Case *c) {
    const int observation = c->network.def.observation, actor = c->network.actor_input;
    float *encoder = c->parameters + c->network.encoder.layer[0].weight;
    float *first = c->parameters + c->network.actor.layer[0].weight;
    for (int i = 0; !c->network.def.actor_phase && i < c->network.encoder.layer[0].out; i++) {
        for (int k = 0; k < c->network.def.frames * observation; k++) {
            const int is_clock = k % observation >= observation - 2;
            encoder[i * c->network.history + k] *= is_clock ? 0.0f : 1.0f;
        }
    }
    for (int i = 0; !c->network.def.actor_phase && i < c->network.actor.layer[0].out; i++) {
        first[i * actor + observation - 2] = first[i * actor + observation - 1] = 0.0f;
    }
}

/* Normal numbers in every array, none of which lies in another. */
static void fill_inputs(Case *c, Random *random) {
    LossChunk *k = &c->chunk;
    const PolicyDef *d = &c->network.def;
    const struct {
        float *at;
        int64_t count;
        double scale;
    } inputs[] = {{c->parameters, c->network.count, 0.35},
                  {k->history, ROWS * c->network.history, 1.0},
                  {k->estimate, ROWS * d->estimates, 1.0},
                  {k->decoder_target, ROWS * c->network.decoded, 1.0},
                  {k->noise, (ROWS + (k->outputs.noise ? MIRRORED : 0)) * d->latent, 1.0},
                  {k->action, ROWS * d->actions, 1.0},
                  {k->old_mean, ROWS * d->actions, 1.0},
                  {k->advantage, ROWS, 1.0},
                  {k->critic, ROWS * d->critic_input, 1.0},
                  {k->old_value, ROWS, 0.5},
                  {k->returns, ROWS, 1.0}};
    for (size_t i = 0; i < sizeof inputs / sizeof *inputs; i++) {
        fill_normal(inputs[i].at, inputs[i].count, inputs[i].scale, random);
        for (size_t b = 0; b < i; b++) {
            assert_true(inputs[i].at >= inputs[b].at + inputs[b].count ||
                        inputs[b].at >= inputs[i].at + inputs[i].count);
        }
    }
    clear_clock(c);
    for (int r = 0; r < ROWS; r++) {
        k->old_log_prob[r] = (float)(-2.5 + 0.3 * random_normal(random));
    }
    for (int j = 0; j < d->actions; j++) {
        c->context.old_std[j] = j ? 1.1f : 0.8f;
    }
}

/* Central differences with step 1e-6 in double leave about 1e-9; single precision about 1e-6. A
 * parameter whose difference straddles a corner of the loss would show as an outlier: with these
 * draws there is none. */
static void check_differences(PolicyDef policy_def, int clip_value, double free_bits, int sampled,
                              uint64_t seed) {
    Case c;
    Random random = random_at(seed, 0, 0);
    LossSums sums;
    const double *const ours = (const double *)&c.sums, *const wanted = (const double *)&sums;
    case_open(&c, policy_def);
    c.def.clip_value = clip_value;
    c.def.free_bits = free_bits;
    c.chunk.outputs.noise = sampled ? c.chunk.noise : NULL;
    fill_inputs(&c, &random);
    case_run(&c);
    double *p = calloc((size_t)c.network.count, sizeof *p);
    assert_non_null(p);
    for (int64_t i = 0; i < c.network.count; i++) {
        p[i] = c.parameters[i];
    }
    loss_double(&c, p, &sums);
    for (size_t i = 0; i < sizeof sums / sizeof *wanted; i++) {
        assert_near("sum", ours[i], wanted[i], 1e-5);
    }
    assert_true(sums.clipped > 0 && sums.clipped < ROWS);
    const int stride = kit_short() ? 13 : 1; /* divides no width of a layer */
    for (int64_t i = 0; i < c.network.count; i += stride) {
        const double step = 1e-6, at = p[i];
        p[i] = at + step;
        double high = loss_double(&c, p, &sums);
        p[i] = at - step;
        double low = loss_double(&c, p, &sums);
        p[i] = at;
        assert_near("gradient", c.gradient[i], (high - low) / (2.0 * step), 2e-5);
    }
    free(p);
    case_close(&c);
}

TEST(test_matches_differences) {
    PolicyDef def = small_def();
    check_differences(def, 1, 0.0, 0, 1);
    def.modulation_per_dimension = 1;
    check_differences(def, 0, 0.0, 0, 2);
    def.feet_velocity_offset = 0; /* no first group of estimates */
    def.actor_hidden[0] = 0, def.actor_hidden[1] = 0, def.actor_hidden[2] = 0; /* a linear actor */
    check_differences(def, 1, 0.0, 0, 3);
}

/* Theta from the feet's estimates and the clock, and an actor that does not see the clock: each
 * alone and both. */
TEST(test_phase_matches_differences) {
    PolicyDef def = small_def();
    def.modulation_input = POLICY_INPUT_FEET_PHASE;
    check_differences(def, 1, 0.0, 0, 21);
    def.actor_phase = 0;
    check_differences(def, 1, 0.0, 0, 22);
    def.modulation_per_dimension = 1;
    check_differences(def, 0, 0.0, 1, 23);
    def.modulation_input = POLICY_INPUT_FEET;
    def.actor_hidden[0] = 0, def.actor_hidden[1] = 0, def.actor_hidden[2] = 0;
    check_differences(def, 1, 0.0, 0, 24);
}

/* A scan behind the newest frame, which encoder and actor see whole, and its mirror image. */
TEST(test_scan_matches_differences) {
    PolicyDef def = small_def();
    def.scan = 3;
    check_differences(def, 1, 0.0, 0, 31);
    def.modulation_input = POLICY_INPUT_FEET_PHASE;
    def.actor_phase = 0;
    check_differences(def, 0, 0.0, 1, 32);
}

/* What the decoder rebuilds, each part with the mean of its own; and free bits. */
TEST(test_awareness_matches_differences) {
    PolicyDef def = small_def();
    def.ground_offset = 3;
    def.ground_count = 2;
    check_differences(def, 1, 0.0, 0, 11);
    def.decoder_frame = 0;
    check_differences(def, 1, 0.0, 0, 12);
    check_differences(small_def(), 1, 0.7, 0, 13);
    def = small_def();
    check_differences(def, 1, 0.0, 1, 14);
    def.modulation_per_dimension = 1;
    check_differences(def, 1, 0.7, 1, 15);
}

/* The log-variance at -20, -12, 0, 6 and 20, with the gradient pushing down and up: used within its
 * bounds, and no gradient that would push it further out. */
TEST(test_logvar_bounds) {
    static const struct {
        float logvar, used;
        int feels_down, feels_up; /* bool: descent may lower it, raise it */
    } cases[] = {{-20, -12, 0, 1}, {-12, -12, 1, 1}, {0, 0, 1, 1}, {6, 6, 1, 1}, {20, 6, 1, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const float logvar = cases[i].logvar, spread = loss_spread(logvar);
        const double used = (double)cases[i].used;
        assert_near("spread", (double)spread, exp(0.5 * used), 1e-6 * exp(0.5 * used));
        assert_near("KL", (double)loss_latent_twice(0.5f, logvar, spread),
                    0.25 + exp(used) - 1.0 - used, 1e-4 * exp(fabs(used) / 2));
        /* no KL term: the gradient is d_z spread noise / 2, and descent goes against it */
        const float down = loss_logvar_gradient(0.0f, logvar, spread, 1.0f, 3.0f);
        const float up = loss_logvar_gradient(0.0f, logvar, spread, 1.0f, -3.0f);
        const double slope = 1.5 * (double)spread;
        assert_near("down", (double)down, cases[i].feels_down ? slope : 0.0, 1e-6 * slope);
        assert_near("up", (double)up, cases[i].feels_up ? -slope : 0.0, 1e-6 * slope);
    }
}

TEST_MAIN(NULL, NULL)
