/* What an update decides around the gradients of its minibatches, for CPU (ppo.c) and GPU
 * (cuda/update.cu). Written in the common subset of C17 and CUDA C++. */
#ifndef MILD_PPO_STEP_H
#define MILD_PPO_STEP_H

#include <math.h>

#include "base/random.h"
#include "learn/loss_sample.h"
#include "learn/ppo_batch.h"
#include "learn/ppo_def.h"

/* ---- keys of the random numbers (learn/noise.h) ---- */

/* Number env * actions + j of the stream is the noise of action j at time t. */
MILD_HD_FN uint64_t step_action_key(uint64_t seed, int64_t iteration, int t) {
    Random random = random_at(seed, (uint32_t)iteration, (uint32_t)t);
    return random_bits(&random);
}

/* Number env * latent + j of the stream is the noise of z_j at time t with ppo.sample_latent, in
 * the rollout and in every minibatch. So an action's probability is that given its own noise. */
MILD_HD_FN uint64_t step_sampled_key(uint64_t seed, int64_t iteration, int t) {
    Random random = random_at(seed ^ 0x7a6c6174u, (uint32_t)iteration, (uint32_t)t);
    return random_bits(&random);
}

/* draw: number of the minibatch in its update. See ppo_latent_rows. */
MILD_HD_FN uint64_t step_latent_key(uint64_t seed, int64_t iteration, uint32_t draw) {
    Random random = random_at(seed ^ 0x76616573u, (uint32_t)iteration, draw);
    return random_bits(&random);
}

/* ---- the decoder's frames ---- */

/* Bool: the decoder's frame is the next one. */
MILD_HD_FN int step_frame_is_next(const PpoDef *def) {
    return def->decoder_target == PPO_TARGET_NEXT || def->decoder_target == PPO_TARGET_BOTH;
}

/* Bool: batch.frame has the decoder's frames only after they were written there. */
MILD_HD_FN int step_writes_frames(const PpoDef *def) {
    return def->decoder_target != PPO_TARGET_GROUND &&
           (step_frame_is_next(def) || !def->target_noise);
}

/* ---- one minibatch ---- */

/* Entropy of the action, a sum of log std + (1 + ln 2 pi) / 2. */
MILD_HD_FN double step_entropy(int actions, const float *std) {
    double entropy = 0.0;
    for (int j = 0; j < actions; j++) {
        entropy += log((double)std[j]) + 1.4189385332046727;
    }
    return entropy;
}

/* Adds the means of a minibatch to the report. Returns 0 when one of them is not finite. weight,
 * mirror_weight: 1 / samples, 1 / samples with a mirror image. norm: of the gradient. */
MILD_HD_FN int step_report(PpoReport *report, const LossSums *s, double weight,
                           double mirror_weight, double entropy, double norm) {
    const double check = s->surrogate + s->kl + s->reconstruction + s->vae_kl + s->estimate[0] +
                         s->estimate[1] + s->estimate[2] + s->mirror + s->value + norm;
    if (!isfinite(check)) {
        return 0;
    }
    report->surrogate += weight * s->surrogate;
    report->kl += weight * s->kl;
    report->clip_share += weight * s->clipped;
    report->vae_reconstruction += weight * s->reconstruction;
    report->vae_kl += weight * s->vae_kl;
    for (int g = 0; g < LOSS_GROUPS; g++) {
        report->estimate_loss[g] += weight * s->estimate[g];
    }
    report->mirror += mirror_weight * s->mirror;
    report->value_loss += weight * s->value;
    report->entropy += entropy;
    report->gradient_norm += norm;
    return 1;
}

/* 0 before the annealing, 1 after it. A function of the iteration alone, so a resumed run
 * continues in the same way. */
MILD_HD_FN double step_anneal(const PpoDef *def, int64_t iteration) {
    const int first = def->anneal[0], last = def->anneal[1];
    return first < last ? fmin(fmax((double)(iteration - first) / (last - first), 0.0), 1.0) : 0.0;
}

/* The rate that keeps the divergence from the rollout's policy near its target [vendor:
 * factor 1.5]. Below a millionth of the target the divergence is rounding: the first minibatch of
 * an update has none. */
MILD_HD_FN double step_learning_rate(const PpoDef *def, int64_t iteration, double rate, double kl) {
    if (!(def->kl_target > 0.0)) {
        return rate;
    }
    const double anneal = pow(def->anneal_factor, step_anneal(def, iteration)),
                 target = anneal * def->kl_target;
    if (kl > 2.0 * target) {
        rate /= 1.5;
    } else if (kl > 1e-6 * target && kl < 0.5 * target) {
        rate *= 1.5;
    }
    const double most = fmax(anneal * def->learning_rate_max, def->learning_rate_min);
    return fmin(fmax(rate, def->learning_rate_min), most);
}

/* Factor on the gradient. */
MILD_HD_FN double step_clip(const PpoDef *def, double norm) {
    return norm > def->max_gradient_norm ? def->max_gradient_norm / norm : 1.0;
}

/* Lower bound of log std, after every step. */
MILD_HD_FN float step_noise_floor(const PpoDef *def) {
    return (float)log(def->std_min);
}

/* ---- after the minibatches ---- */

/* Upper bound of log std. It is applied between updates, so that the rollout samples from the
 * distribution that the update compares with. */
MILD_HD_FN float step_noise_ceiling(const PpoDef *def, int64_t iteration) {
    return (float)(log(def->std_max[0]) +
                   step_anneal(def, iteration) * log(def->std_max[1] / def->std_max[0]));
}

/* Share of the present weights in their running mean. A young mean decays faster, because otherwise
 * it would retain the initial weights for long. */
MILD_HD_FN float step_average(const PpoDef *def, int64_t iteration) {
    const double young = (1.0 + (double)iteration) / (10.0 + (double)iteration);
    return (float)(1.0 - fmin(def->average, young));
}

/* Sums over `taken` minibatches become means. */
MILD_HD_FN void step_finish_report(PpoReport *report, int taken, int actions, const float *std,
                                   double learning_rate) {
    const double w = taken > 0 ? 1.0 / taken : 0.0;
    double *const means[] = {&report->surrogate,        &report->value_loss,
                             &report->entropy,          &report->kl,
                             &report->clip_share,       &report->gradient_norm,
                             &report->mirror,           &report->vae_kl,
                             &report->estimate_loss[0], &report->estimate_loss[1],
                             &report->estimate_loss[2], &report->vae_reconstruction};
    for (size_t i = 0; i < sizeof means / sizeof *means; i++) {
        *means[i] *= w;
    }
    for (int j = 0; j < actions; j++) {
        report->action_std += (double)std[j] / actions;
    }
    report->learning_rate = learning_rate;
}

/* From the moments over the usable samples. returns - value is the advantage before it is
 * normalised. */
MILD_HD_FN void step_report_returns(PpoReport *report, double value_mean, double advantage_std,
                                    double returns_std) {
    report->value_mean = value_mean;
    report->advantage_std = advantage_std;
    report->explained_variance =
        returns_std > 0.0 ? 1.0 - pow(advantage_std / returns_std, 2) : 0.0;
}

#endif
