#include "learn/ppo_def.h"

#include "learn/order.h"

PpoDef ppo_def_default(void) {
    return (PpoDef){
        .steps = 24,
        .epochs = 4,
        .minibatches = 4,
        .shards = 8,
        .gamma = 0.994,
        .lambda = 0.9,
        .clip = 0.2,
        .entropy = 0.001,
        .value_weight = 1.0,
        .clip_value = 1,
        .learning_rate = 1e-3,
        .learning_rate_min = 1e-5,
        .learning_rate_max = 2e-3,
        .kl_target = 0.01,
        .max_gradient_norm = 1.0,
        .epsilon = 0.3,
        .decoder_target = PPO_TARGET_NEXT,
        .target_noise = 1,
        .kl_weight = 0.001,
        .modulation = 1,
        .mirror_weight = 1.0,
        .mirror_share = 0.5,
        .std_min = 0.05,
        .anneal_factor = 0.1,
        .std_max = {10.0, 10.0},
    };
}

void ppo_set_decoder(const PpoDef *def, int ground_offset, int ground_count, PolicyDef *policy) {
    const int ground =
        def->decoder_target == PPO_TARGET_GROUND || def->decoder_target == PPO_TARGET_BOTH;
    policy->decoder_frame = def->decoder_target != PPO_TARGET_GROUND;
    policy->ground_offset = ground ? ground_offset : 0;
    policy->ground_count = ground ? ground_count : 0;
}

const char *const ppo_optimizer_names[PPO_OPTIMIZERS] = {"adam", "muon"};
static const char *const target_names[PPO_TARGETS] = {"newest", "next", "ground", "both"};
static const char *const matmul_names[PPO_MATMULS] = {"fp32", "tf32", "bf16"};

const MildField ppo_fields[] = {
    MILD_FIELD(PpoDef, steps, MILD_FIELD_INT, 1, 1, 1024, "[-] rollout length per environment"),
    MILD_FIELD(PpoDef, epochs, MILD_FIELD_INT, 1, 1, 64, "[-] passes over a rollout per update"),
    MILD_FIELD(PpoDef, minibatches, MILD_FIELD_INT, 1, 1, 1024,
               "[-] minibatches, and so optimiser steps, per pass"),
    MILD_FIELD(PpoDef, shards, MILD_FIELD_INT, 1, 1, PPO_SHARDS_MAX,
               "[-] parts of a minibatch with a gradient each, a power of two: as many processes "
               "can train together. Another number is another order of samples and sums"),
    MILD_FIELD(PpoDef, gamma, MILD_FIELD_DOUBLE, 1, 0.0, 1.0, "[-] discount per policy step"),
    MILD_FIELD(PpoDef, lambda, MILD_FIELD_DOUBLE, 1, 0.0, 1.0,
               "[-] decay of generalised advantage estimation"),
    MILD_FIELD(PpoDef, clip, MILD_FIELD_DOUBLE, 1, 0.01, 10.0,
               "[-] clip range of the probability ratio and of the change of the value"),
    MILD_FIELD(PpoDef, entropy, MILD_FIELD_DOUBLE, 1, 0.0, 1.0, "[-] weight of the entropy bonus"),
    MILD_FIELD(PpoDef, value_weight, MILD_FIELD_DOUBLE, 1, 0.0, 100.0,
               "[-] weight of the value loss"),
    MILD_FIELD(PpoDef, clip_value, MILD_FIELD_BOOL, 1, 0, 1, "[-] clip the value loss"),
    MILD_FIELD_CHOICE(
        PpoDef, optimizer, ppo_optimizer_names, PPO_OPTIMIZERS,
        "[-] muon moves the weights between hidden layers by orthogonal matrices, and "
        "the other parameters as adam does (docs/gpu.md)"),
    MILD_FIELD(PpoDef, learning_rate, MILD_FIELD_DOUBLE, 1, 0.0, 1.0,
               "[-] learning rate at the start"),
    MILD_FIELD(PpoDef, learning_rate_min, MILD_FIELD_DOUBLE, 1, 0.0, 1.0,
               "[-] lower bound of the adapted learning rate"),
    MILD_FIELD(PpoDef, learning_rate_max, MILD_FIELD_DOUBLE, 1, 0.0, 1.0,
               "[-] upper bound of the adapted learning rate"),
    MILD_FIELD(
        PpoDef, kl_target, MILD_FIELD_DOUBLE, 1, 0.0, 1.0,
        "[nat] KL divergence per update that the learning rate is adapted to; 0: fixed rate"),
    MILD_FIELD(PpoDef, max_gradient_norm, MILD_FIELD_DOUBLE, 1, 1e-6, 1e6,
               "[-] a gradient with a larger norm is scaled down to this norm"),
    MILD_FIELD(PpoDef, epsilon, MILD_FIELD_DOUBLE, 1, 0.0, 1.0,
               "[-] share of the regression losses in the joint loss; the rest is PPO's"),
    MILD_FIELD_CHOICE(PpoDef, decoder_target, target_names, PPO_TARGETS,
                      "[-] what the decoder reconstructs: the newest frame, the next one, the "
                      "ground's parameters in the critic's input, or the next frame and these"),
    MILD_FIELD(
        PpoDef, target_noise, MILD_FIELD_BOOL, 1, 0, 1,
        "[bool] the decoder's frame as the policy sees it; false: without noise and latency, as "
        "the critic sees it"),
    MILD_FIELD(PpoDef, kl_weight, MILD_FIELD_DOUBLE, 1, 0.0, 10.0,
               "[-] weight of the KL divergence between the latent and N(0, I)"),
    MILD_FIELD(PpoDef, free_bits, MILD_FIELD_DOUBLE, 1, 0.0, 100.0,
               "[nat] KL divergence of each latent dimension below which it costs nothing"),
    MILD_FIELD(PpoDef, sample_latent, MILD_FIELD_BOOL, 1, 0, 1,
               "[bool] in training the actor gets a latent drawn around mu, as the decoder does; "
               "false: mu"),
    MILD_FIELD(PpoDef, modulation, MILD_FIELD_BOOL, 1, 0, 1,
               "[bool] the modulation learns; false: theta1 = 1 and theta2 = 0, as it starts"),
    MILD_FIELD(PpoDef, mirror_weight, MILD_FIELD_DOUBLE, 1, 0.0, 100.0,
               "[-] weight of the mirror symmetry loss"),
    MILD_FIELD(PpoDef, mirror_share, MILD_FIELD_DOUBLE, 1, 0.0, 1.0,
               "[-] share of each minibatch on which the mirror loss is computed"),
    MILD_FIELD(PpoDef, std_min, MILD_FIELD_DOUBLE, 1, 1e-4, 1.0,
               "[-] lower bound of the standard deviation of the action noise"),
    MILD_FIELD(PpoDef, anneal, MILD_FIELD_INT, 2, 0, 1e9,
               "[-] first and last iteration of the annealing; equal: no annealing"),
    MILD_FIELD(PpoDef, anneal_factor, MILD_FIELD_DOUBLE, 1, 1e-6, 1.0,
               "[-] factor on kl_target and learning_rate_max at the end of the annealing"),
    MILD_FIELD(
        PpoDef, std_max, MILD_FIELD_DOUBLE, 2, 1e-4, 10.0,
        "[-] upper bound of the standard deviation of the action noise, before and after the "
        "annealing"),
    MILD_FIELD(
        PpoDef, average, MILD_FIELD_DOUBLE, 1, 0.0, 0.9999,
        "[-] decay per iteration of the running mean of the weights; the mean is saved as the "
        "policy; 0: no mean"),
    MILD_FIELD_CHOICE(
        PpoDef, matmul, matmul_names, PPO_MATMULS,
        "[-] arithmetic of the matrix products: tf32 rounds their factors on a GPU; bf16 all "
        "numbers between the layers there, and factors on a CPU with AVX512_BF16 or AMX "
        "(docs/gpu.md)"),
};
const int ppo_field_count = (int)(sizeof ppo_fields / sizeof *ppo_fields);
