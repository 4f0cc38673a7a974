/* The losses of one sample and their gradients, for the CPU (loss.c) and the GPU (kernels.cu). The
 * caller provides the loop over samples, the sums and the weights. A weight is the weight of a loss
 * in the minibatch, including the factor 1 / samples. Written in the common subset of C17 and CUDA
 * C++. */
#ifndef MILD_LOSS_SAMPLE_H
#define MILD_LOSS_SAMPLE_H

#include <math.h>

#include "base/hd.h"
#include "learn/vector.h"

/* The log-variance is clamped to these bounds, so that e^logvar cannot overflow early in
 * training. */
#define LOSS_LOGVAR_MIN (-12.0f)
#define LOSS_LOGVAR_MAX 6.0f

#define LOSS_HALF_LOG_2PI 0.91893853320467274

/* Groups of estimates: before, in and after the feet velocities. These are base velocity, feet
 * velocities and feet heights. */
#define LOSS_GROUPS 3

/* Sums over samples, not yet divided. The entropy is missing, because it does not depend on the
 * sample. */
typedef struct {
    double surrogate;
    double kl;      /* [nat] KL(old || new) of the action */
    double clipped; /* samples whose ratio is outside the clip range */
    double reconstruction;
    double vae_kl; /* [nat] of the latent */
    double estimate[LOSS_GROUPS];
    double mirror;
    double value;
} LossSums;

/* ---- clipped surrogate: -min(r A, clip(r) A), r = exp(log_prob - old_log_prob) ---- */

typedef struct {
    float loss;
    float kl;         /* KL(old || new) */
    float d_log_prob; /* derivative of the loss: -r A if r A is the smaller term, else 0 */
    int clipped;      /* bool: r is outside its clip range */
} LossSurrogate;

/* Distance of an action from the mean, in standard deviations. inverse: 1 / std. */
MILD_HD_FN float loss_standard(float action, float mean, float inverse) {
    return (action - mean) * inverse;
}

/* The part of the surrogate that is the same for all samples: 1/std [actions], then the constants
 * of log_prob and of KL(old || new), which is
 *     sum log(std/old) + (old^2 + (old_mean - mean)^2) / (2 std^2) - 1/2. */
MILD_HD_FN void loss_surrogate_constants(int actions, const float *std, const float *old_std,
                                         float *constant) {
    double log_prob = 0.0, kl = 0.0;
    for (int j = 0; j < actions; j++) {
        const double ratio = (double)old_std[j] / (double)std[j];
        constant[j] = 1.0f / std[j];
        log_prob -= log((double)std[j]) + LOSS_HALF_LOG_2PI;
        kl += 0.5 * ratio * ratio - 0.5 - log(ratio);
    }
    constant[actions] = (float)log_prob;
    constant[actions + 1] = (float)kl;
}

/* log of the normal density of `action`, independent dimensions. */
MILD_HD_FN float loss_log_prob(int actions, const float *action, const float *mean,
                               const float *std) {
    double sum = 0.0;
    for (int j = 0; j < actions; j++) {
        const double t = ((double)action[j] - (double)mean[j]) / (double)std[j];
        sum -= 0.5 * t * t + log((double)std[j]) + LOSS_HALF_LOG_2PI;
    }
    return (float)sum;
}

/* From the log density of the action and KL(old || new). */
MILD_HD_FN LossSurrogate loss_surrogate_of(float clip, float log_prob, float kl, float old_log_prob,
                                           float advantage) {
    LossSurrogate s;
    const float ratio = expf(log_prob - old_log_prob);
    const float held = fminf(fmaxf(ratio, 1.0f - clip), 1.0f + clip);
    const float free_term = ratio * advantage;
    const float held_term = held * advantage;
    const int is_free = free_term <= held_term;
    s.kl = kl;
    s.loss = -(is_free || isnan(free_term) ? free_term : held_term); /* NaN must propagate */
    s.d_log_prob = is_free ? -free_term : 0.0f;
    s.clipped = ratio != held;
    return s;
}

/* constant [actions + 2]: see loss_surrogate_constants. */
MILD_HD_FN LossSurrogate loss_surrogate(int actions, const float *constant, float clip,
                                        const float *action, const float *mean,
                                        const float *old_mean, float old_log_prob,
                                        float advantage) {
    float log_prob = constant[actions], kl = constant[actions + 1];
    for (int j = 0; j < actions; j++) {
        const float t = loss_standard(action[j], mean[j], constant[j]);
        const float shift = loss_standard(old_mean[j], mean[j], constant[j]);
        log_prob -= 0.5f * t * t;
        kl += 0.5f * shift * shift;
    }
    return loss_surrogate_of(clip, log_prob, kl, old_log_prob, advantage);
}

/* Converts the gradient with respect to log_prob to those with respect to the mean and the log std
 * of an action. t: loss_standard. */
MILD_HD_FN float loss_mean_gradient(float d_log_prob, float t, float inverse) {
    return d_log_prob * t * inverse;
}

MILD_HD_FN float loss_log_std_gradient(float d_log_prob, float t) {
    return d_log_prob * (t * t - 1.0f);
}

/* ---- mirror: sum over actions of (mean(o) - M_a mean(M_o o))^2 ---- */

/* The square of an action's gap; image: of the action that is its mirror image. The gradient flows
 * through both means, because either may be the better one: adds to d_mean and overwrites d_image.
 * weight: of the gradient, which is twice the weight of the square. */
MILD_HD_FN float loss_mirror_action(float weight, float sign, float mean, float image,
                                    float *d_mean, float *d_image) {
    const float gap = mean - sign * image;
    *d_mean += weight * gap;
    *d_image = -(weight * sign * gap);
    return gap * gap;
}

/* Returns the sum. index: a permutation. */
MILD_HD_FN float loss_mirror(int actions, const int *index, const float *sign, float weight,
                             const float *mean, const float *image, float *d_mean, float *d_image) {
    float sum = 0.0f;
    for (int j = 0; j < actions; j++) {
        const int k = index[j];
        sum += loss_mirror_action(weight, sign[j], mean[j], image[k], &d_mean[j], &d_image[k]);
    }
    return sum;
}

/* ---- regression of the estimates ---- */

/* The square of an estimate's gap; adds to its d. weight: twice that of the square. */
MILD_HD_FN float loss_estimate(float weight, float estimate, float target, float *d) {
    const float gap = estimate - target;
    *d += weight * gap;
    return gap * gap;
}

/* Mean square of the estimates begin .. end-1; adds to d. weight: twice that of the mean. An empty
 * group costs nothing. */
MILD_HD_FN double loss_estimates(int begin, int end, float weight, const float *estimate,
                                 const float *target, float *d) {
    if (begin == end) {
        return 0.0;
    }
    const float weight_each = weight / (float)(end - begin);
    float sum = 0.0f;
    for (int j = begin; j < end; j++) {
        sum += loss_estimate(weight_each, estimate[j], target[j], &d[j]);
    }
    return (double)sum / (end - begin);
}

/* ---- latent: z = mu + spread noise, KL(N(mu, e^logvar) || N(0, 1)) ---- */

MILD_HD_FN float loss_held_logvar(float logvar) {
    const float held = logvar < LOSS_LOGVAR_MIN ? LOSS_LOGVAR_MIN : logvar;
    return held > LOSS_LOGVAR_MAX ? LOSS_LOGVAR_MAX : held;
}

/* Standard deviation of the latent. */
MILD_HD_FN float loss_spread(float logvar) {
    return vector_exp(0.5f * loss_held_logvar(logvar));
}

/* Dimension j of z: a draw, or mu without noise. */
MILD_HD_FN float loss_latent(const float *mu, const float *logvar, const float *noise, int j) {
    return noise ? mu[j] + loss_spread(logvar[j]) * noise[j] : mu[j];
}

/* Twice the KL term of one dimension: mu^2 + e^logvar - 1 - logvar. */
MILD_HD_FN float loss_latent_twice(float mu, float logvar, float spread) {
    return mu * mu + spread * spread - 1.0f - loss_held_logvar(logvar);
}

/* Weight of the gradient of a dimension's KL term max(KL, free_bits) [nat] (Kingma et al. 2016,
 * "free bits"): the dimension may carry this much for nothing. twice: 2 KL. */
MILD_HD_FN float loss_kl_weight(float weight, float free_bits, float twice) {
    return free_bits > 0.0f && twice < 2.0f * free_bits ? 0.0f : weight;
}

/* d_z of a sample: from the decoder, and from the actor if it got the same draw. d_mu: what the
 * actor has left. */
MILD_HD_FN float loss_draw_gradient(int sampled, float d_z, float d_mu) {
    return sampled ? d_z + d_mu : d_z;
}

/* d loss / d mu: from the decoder through z, and from the KL term. */
MILD_HD_FN float loss_mu_gradient(float weight, float mu, float d_z) {
    return d_z + weight * mu;
}

/* d loss / d logvar. Outside its bounds the log-variance receives only gradients that lead back
 * inside. */
MILD_HD_FN float loss_logvar_gradient(float weight, float logvar, float spread, float noise,
                                      float d_z) {
    const float d = 0.5f * (d_z * spread * noise + weight * (spread * spread - 1.0f));
    const float outward = (logvar - loss_held_logvar(logvar)) * d;
    return outward < 0.0f ? 0.0f : d;
}

/* ---- modulation ---- */

/* Back through z~ = theta1 z + theta2, z: loss_latent. heads and d_heads are [estimates | mu |
 * logvar], d_input is [estimates | z~]; theta has two numbers, or two for each latent dimension.
 * noise: NULL, z = mu. */

/* Number i of d_heads. */
MILD_HD_FN float loss_modulation_head(int estimates, int latent, int per_dimension,
                                      const float *heads, const float *noise, const float *theta,
                                      const float *d_input, int i) {
    const int is_logvar = i >= estimates + latent, j = i - estimates - (is_logvar ? latent : 0);
    if (j < 0) {
        return d_input[i];
    }
    const float d_z = d_input[estimates + j] * theta[per_dimension ? j : 0];
    if (!is_logvar) {
        return d_z;
    }
    return noise ? loss_logvar_gradient(0.0f, heads[i], loss_spread(heads[i]), noise[j], d_z)
                 : 0.0f;
}

/* Number i of d_theta, of a modulation that learns. */
MILD_HD_FN float loss_modulation_theta(int estimates, int latent, int per_dimension,
                                       const float *heads, const float *noise, const float *d_input,
                                       int i) {
    const float *mu = heads + estimates, *d = d_input + estimates;
    const int is_shift = i >= (per_dimension ? latent : 1),
              begin = per_dimension ? i - (is_shift ? latent : 0) : 0,
              end = per_dimension ? begin + 1 : latent;
    float sum = 0.0f;
    for (int j = begin; j < end; j++) {
        sum += is_shift ? d[j] : d[j] * loss_latent(mu, mu + latent, noise, j);
    }
    return sum;
}

/* ---- value: max((V - R)^2, (V_old + clip(V - V_old) - R)^2) ---- */

/* Returns the gap whose square is the loss, and writes half of the gradient. Where the clipped
 * branch is the larger one, its gradient is that of V inside the clip range and 0 outside. */
MILD_HD_FN float loss_value(int clip_value, float clip, float value, float old_value, float returns,
                            float *half_gradient) {
    const float gap = value - returns;
    const float move = value - old_value;
    const float held_move = move < -clip ? -clip : move > clip ? clip : move;
    const float held_gap = old_value + held_move - returns;
    const int held = clip_value && held_gap * held_gap > gap * gap;
    const float used = held ? held_gap : gap;
    *half_gradient = held && held_move != move ? 0.0f : used;
    return used;
}

#endif
