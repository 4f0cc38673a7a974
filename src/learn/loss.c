#include "learn/loss.h"

#include <math.h>
#include <string.h>

size_t loss_carve(const Network *network, int rows, int mirrored, float *block, LossChunk *chunk) {
    const PolicyDef *def = &network->def;
    const Mlp *const mlps[] = {&network->encoder, &network->decoder, &network->modulation,
                               &network->actor, &network->critic};
    size_t used = 0, n = (size_t)rows, all = n + (size_t)mirrored, widest = 0;
    for (int i = 0; i < NETWORK_MLPS; i++) {
        size_t width = (size_t)mlp_widest(mlps[i]);
        widest = width > widest ? width : widest;
    }
    struct {
        float **at;
        size_t count;
    } areas[] = {
        {&chunk->history, all * (size_t)network->history},
        {&chunk->estimate, n * (size_t)def->estimates},
        {&chunk->decoder_target, n * (size_t)network->decoded},
        {&chunk->noise, all * (size_t)def->latent},
        {&chunk->action, n * (size_t)def->actions},
        {&chunk->old_mean, n * (size_t)def->actions},
        {&chunk->old_log_prob, n},
        {&chunk->advantage, n},
        {&chunk->critic, n * (size_t)def->critic_input},
        {&chunk->old_value, n},
        {&chunk->returns, n},
        {&chunk->decoder_input, n * (size_t)network->decoder_input},
        {&chunk->spread, n * (size_t)def->latent},
        {&chunk->d_mean, all * (size_t)def->actions},
        {&chunk->d_heads, all * (size_t)network->heads},
        {&chunk->d_theta, all * (size_t)network->theta},
        {&chunk->d_actor_input, all * (size_t)(def->estimates + def->latent)},
        {&chunk->d_feet, all * (size_t)network->feet},
        {&chunk->d_decoded, n * (size_t)network->decoded},
        {&chunk->d_decoder_input, n * (size_t)network->decoder_input},
        {&chunk->d_value, n},
        {&chunk->work[0], all * widest},
        {&chunk->work[1], all * widest},
    };
    for (size_t i = 0; i < sizeof areas / sizeof *areas; i++) {
        *areas[i].at = mlp_carve(block, &used, areas[i].count);
    }
    network_carve(network, rows + mirrored, block, &used, &chunk->outputs);
    mlp_carve_outputs(&network->decoder, rows, block, &used, &chunk->decoder);
    mlp_carve_outputs(&network->critic, rows, block, &used, &chunk->value);
    return used;
}

void loss_mirror_row(const LossContext *context, LossChunk *chunk, int from, int to) {
    const Network *n = context->network;
    const int observation = n->def.observation, width = n->history, end = width - n->def.scan;
    const int *index = context->mirror->observation_index;
    const float *sign = context->mirror->observation_sign;
    const float *o = chunk->history + (int64_t)from * width;
    float *m = chunk->history + (int64_t)to * width;
    for (int f = 0; f < end; f += observation) {
        const int numbers = f + observation < end ? observation : n->newest;
        for (int i = 0; i < numbers; i++) {
            m[f + i] = sign[i] * o[f + index[i]];
        }
    }
}

/* Clipped surrogate of sample r. */
static void surrogate_row(const LossContext *c, const LossChunk *chunk, int r,
                          const float *constant, const float *mean, float *d_mean, float *d_log_std,
                          LossSums *sums) {
    const int actions = c->network->def.actions;
    const float *action = chunk->action + (int64_t)r * actions;
    const float *old_mean = chunk->old_mean + (int64_t)r * actions;
    const LossSurrogate s = loss_surrogate(actions, constant, (float)c->def->clip, action, mean,
                                           old_mean, chunk->old_log_prob[r], chunk->advantage[r]);
    const float d_log_prob = s.d_log_prob * c->sample_weight * (float)(1.0 - c->def->epsilon);
    for (int j = 0; j < actions; j++) {
        const float t = loss_standard(action[j], mean[j], constant[j]);
        d_mean[j] = loss_mean_gradient(d_log_prob, t, constant[j]);
        d_log_std[j] += loss_log_std_gradient(d_log_prob, t);
    }
    sums->surrogate += s.loss;
    sums->clipped += s.clipped;
    sums->kl += s.kl;
}

/* Surrogate and entropy sum log std: writes d_mean of the samples and the gradient of log std. */
static void policy_loss(const LossContext *c, LossChunk *chunk, const float *mean, float *d_log_std,
                        float beta, LossSums *sums) {
    const int actions = c->network->def.actions;
    float constant[NETWORK_ACTIONS_MAX + 2];
    loss_surrogate_constants(actions, c->std, c->old_std, constant);
    float entropy_share =
        (float)((1.0 - c->def->epsilon) * c->def->entropy) * c->sample_weight * (float)chunk->rows;
    for (int j = 0; j < actions; j++) {
        d_log_std[j] =
            (beta == 0.0f ? 0.0f : d_log_std[j]) - entropy_share; /* 0 * NaN would stay NaN */
    }
    for (int r = 0; r < chunk->rows; r++) {
        surrogate_row(c, chunk, r, constant, mean + (int64_t)r * actions,
                      chunk->d_mean + (int64_t)r * actions, d_log_std, sums);
    }
}

/* Mean over samples and actions of (mean(o) - M_a mean(M_o o))^2. */
static void mirror_loss(const LossContext *c, LossChunk *chunk, const float *mean, LossSums *sums) {
    const int actions = c->network->def.actions;
    const float weight = 2.0f * (float)c->def->mirror_weight * c->mirror_weight / (float)actions;
    const float *image = mean + (int64_t)chunk->rows * actions;
    float *d_mean = chunk->d_mean;
    float *d_image = d_mean + (int64_t)chunk->rows * actions;
    for (int r = 0; r < chunk->mirrored; r++) {
        const int64_t at = (int64_t)r * actions;
        const float sum = loss_mirror(actions, c->mirror->action_index, c->mirror->action_sign,
                                      weight, mean + at, image + at, d_mean + at, d_image + at);
        sums->mirror += (double)sum / actions;
    }
}

/* z = mu + exp(logvar/2) noise; decoder input [z | estimates]. */
static void sample_latent(const LossContext *c, LossChunk *chunk, const float *heads) {
    const int latent = c->network->def.latent, estimates = c->network->def.estimates;
    float *input = chunk->decoder_input, *spread = chunk->spread;
    const float *noise = chunk->noise;
    for (int r = 0; r < chunk->rows; r++) {
        const float *mu = heads + estimates, *logvar = mu + latent;
#pragma omp simd
        for (int j = 0; j < latent; j++) {
            spread[j] = loss_spread(logvar[j]);
            input[j] = mu[j] + spread[j] * noise[j];
        }
        memcpy(input + latent, heads, (size_t)estimates * sizeof *input);
        heads += c->network->heads, input += c->network->decoder_input, spread += latent,
            noise += latent;
    }
}

/* Numbers first .. first + width - 1 of the decoder's output: mean over samples and over them of
 * (decoded - target)^2. */
static void reconstruction_part(const LossContext *c, LossChunk *chunk, const float *decoded,
                                int first, int width, LossSums *sums) {
    const int stride = c->network->decoded;
    const float weight = 2.0f * (float)c->def->epsilon * c->sample_weight / (float)width;
    const float *target = chunk->decoder_target + first;
    float *d = chunk->d_decoded + first;
    decoded += first;
    for (int r = 0; r < chunk->rows; r++, decoded += stride, target += stride, d += stride) {
        float sum = 0.0f;
#pragma omp simd reduction(+ : sum)
        for (int j = 0; j < width; j++) {
            float gap = decoded[j] - target[j];
            sum += gap * gap;
            d[j] = weight * gap;
        }
        sums->reconstruction += (double)sum / width;
    }
}

static void reconstruction_loss(const LossContext *c, LossChunk *chunk, const float *decoded,
                                LossSums *sums) {
    const int frame = c->network->decoded_frame, ground = c->network->def.ground_count;
    if (frame > 0) {
        reconstruction_part(c, chunk, decoded, 0, frame, sums);
    }
    if (ground > 0) {
        reconstruction_part(c, chunk, decoded, frame, ground, sums);
    }
}

/* MSE of each group of estimates; adds to d (row of the heads' gradient). */
static void estimate_row(const LossContext *c, const float *estimate, const float *target, float *d,
                         LossSums *sums) {
    const PolicyDef *def = &c->network->def;
    const int ends[LOSS_GROUPS + 1] = {0, def->feet_velocity_offset,
                                       def->feet_velocity_offset + def->feet_velocity_count,
                                       def->estimates};
    const float weight = 2.0f * (float)c->def->epsilon * c->sample_weight;
    for (int g = 0; g < LOSS_GROUPS; g++) {
        sums->estimate[g] += loss_estimates(ends[g], ends[g + 1], weight, estimate, target, d);
    }
}

/* max(KL(N(mu, e^logvar) || N(0, 1)), free bits) of each dimension, and the decoder's gradient
 * through the sampled z. */
static void latent_row(const LossContext *c, const float *mu, const float *logvar,
                       const float *spread, const float *noise, int sampled, const float *d_z,
                       float *d_mu, float *d_logvar, LossSums *sums) {
    const int latent = c->network->def.latent;
    const float weight = (float)(c->def->epsilon * c->def->kl_weight) * c->sample_weight;
    const float free_bits = (float)c->def->free_bits;
    float twice = 0.0f;
#pragma omp simd reduction(+ : twice)
    for (int j = 0; j < latent; j++) {
        const float own = loss_latent_twice(mu[j], logvar[j], spread[j]),
                    w = loss_kl_weight(weight, free_bits, own);
        twice += own;
        const float d_draw = loss_draw_gradient(sampled, d_z[j], d_mu[j]);
        d_mu[j] += loss_mu_gradient(w, mu[j], d_z[j]);
        d_logvar[j] = loss_logvar_gradient(w, logvar[j], spread[j], noise[j], d_draw);
    }
    sums->vae_kl += 0.5 * (double)twice;
}

/* Back through z~ = theta1 z + theta2: d_heads and d_theta. */
static void modulation_backward(const LossContext *c, LossChunk *chunk, int all,
                                const float *heads) {
    const Network *n = c->network;
    const int estimates = n->def.estimates, latent = n->def.latent,
              per_dimension = n->def.modulation_per_dimension;
    const float *theta = network_theta(n, &chunk->outputs), *noise = chunk->outputs.noise;
    for (int64_t r = 0; r < all; r++) {
        const float *d_input = chunk->d_actor_input + r * (estimates + latent);
        for (int i = 0; i < n->heads; i++) {
            chunk->d_heads[r * n->heads + i] = loss_modulation_head(
                estimates, latent, per_dimension, heads, noise, theta, d_input, i);
        }
        for (int i = 0; i < n->theta; i++) {
            chunk->d_theta[r * n->theta + i] =
                c->def->modulation ? loss_modulation_theta(estimates, latent, per_dimension, heads,
                                                           noise, d_input, i)
                                   : 0.0f;
        }
        heads += n->heads;
        theta += n->theta;
        noise = noise ? noise + latent : NULL;
    }
}

/* Regression part of the heads' gradient, and the modulation's through the estimates of the feet.
 */
static void heads_backward(const LossContext *c, LossChunk *chunk, int all, const float *heads,
                           LossSums *sums) {
    const Network *n = c->network;
    const int estimates = n->def.estimates, latent = n->def.latent, feet = n->feet;
    for (int r = 0; r < all; r++) {
        float *d = chunk->d_heads + (int64_t)r * n->heads;
        for (int j = 0; j < feet; j++) {
            d[n->def.feet_velocity_offset + j] += chunk->d_feet[(int64_t)r * feet + j];
        }
    }
    for (int r = 0; r < chunk->rows; r++, heads += n->heads) {
        float *d = chunk->d_heads + (int64_t)r * n->heads;
        const float *d_input = chunk->d_decoder_input + (int64_t)r * n->decoder_input;
        for (int j = 0; j < estimates; j++) {
            d[j] += d_input[latent + j];
        }
        estimate_row(c, heads, chunk->estimate + (int64_t)r * estimates, d, sums);
        latent_row(c, heads + estimates, heads + estimates + latent,
                   chunk->spread + (int64_t)r * latent, chunk->noise + (int64_t)r * latent,
                   chunk->outputs.noise != NULL, d_input, d + estimates, d + estimates + latent,
                   sums);
    }
}

void loss_actor(const LossContext *c, LossChunk *chunk, float *gradient, float beta,
                LossSums *sums) {
    const Network *n = c->network;
    const PolicyDef *def = &n->def;
    const int all = chunk->rows + chunk->mirrored;
    NetworkOutputs *out = &chunk->outputs;
    const float *mean = network_forward(n, c->parameters, all, chunk->history, out);
    const float *heads = network_heads(n, out);
    sample_latent(c, chunk, heads);
    const float *decoded = mlp_forward(&n->decoder, c->parameters, chunk->rows,
                                       chunk->decoder_input, n->decoder_input, &chunk->decoder);

    policy_loss(c, chunk, mean, gradient + n->log_std, beta, sums);
    if (chunk->mirrored > 0) {
        mirror_loss(c, chunk, mean, sums);
    }
    reconstruction_loss(c, chunk, decoded, sums);

    mlp_backward(&n->decoder, c->parameters, chunk->rows, chunk->decoder_input, n->decoder_input,
                 &chunk->decoder, chunk->d_decoded, chunk->work, gradient, beta,
                 (MlpInputGradient){chunk->d_decoder_input, 0, n->decoder_input});
    mlp_backward(&n->actor, c->parameters, all, out->actor_input, n->actor_input, &out->actor,
                 chunk->d_mean, chunk->work, gradient, beta,
                 (MlpInputGradient){chunk->d_actor_input, n->newest, def->estimates + def->latent});
    modulation_backward(c, chunk, all, heads);
    mlp_backward(&n->modulation, c->parameters, all, out->modulation_input, n->feet + n->clock,
                 &out->modulation, chunk->d_theta, chunk->work, gradient, beta,
                 (MlpInputGradient){chunk->d_feet, 0, n->feet});
    heads_backward(c, chunk, all, heads, sums);
    mlp_backward(&n->encoder, c->parameters, all, chunk->history, n->history, &out->encoder,
                 chunk->d_heads, chunk->work, gradient, beta, (MlpInputGradient){0});
    network_hide_clock(n, gradient);
}

void loss_critic(const LossContext *c, LossChunk *chunk, float *gradient, float beta,
                 LossSums *sums) {
    const Network *n = c->network;
    const float *value = mlp_forward(&n->critic, c->parameters, chunk->rows, chunk->critic,
                                     n->def.critic_input, &chunk->value);
    const float clip = (float)c->def->clip;
    const float weight =
        2.0f * (float)((1.0 - c->def->epsilon) * c->def->value_weight) * c->sample_weight;
    for (int r = 0; r < chunk->rows; r++) {
        float half;
        const float gap = loss_value(c->def->clip_value, clip, value[r], chunk->old_value[r],
                                     chunk->returns[r], &half);
        sums->value += (double)gap * gap;
        chunk->d_value[r] = weight * half;
    }
    mlp_backward(&n->critic, c->parameters, chunk->rows, chunk->critic, n->def.critic_input,
                 &chunk->value, chunk->d_value, chunk->work, gradient, beta, (MlpInputGradient){0});
}
