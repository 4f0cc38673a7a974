/* The learner on the GPU against the same learner on the processor. With MILD_CUDA on the device,
 * skipped (77) where there is none; else with small networks on a stand-in for CUDA (emulated/),
 * which runs the same text of the layer. */
#include "../learn/toy.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "gpu/learner.h"
#include "learn/ppo_gradient.h"
#include "learn/ppo_returns.h"

#ifdef EMULATED
extern int emulated_failure;
#endif

typedef struct {
    Policy *policy;
    Pool *pool;
    Ppo *ppo;
    int mirror_index[64];
    float mirror_sign[64];
} Learner;

/* Swaps neighbours and changes every third sign: its own inverse, as a mirror is. */
static PpoMirror some_mirror(Learner *l, const PolicyDef *def) {
    const int count = def->observation > def->actions ? def->observation : def->actions;
    for (int i = 0; i < count; i++) {
        l->mirror_index[i] = i;
        l->mirror_sign[i] = i % 3 ? 1.0f : -1.0f;
    }
    for (int i = 0; i + 1 < def->actions && i + 1 < def->observation; i += 2) {
        l->mirror_index[i] = i + 1;
        l->mirror_index[i + 1] = i;
    }
    return (PpoMirror){l->mirror_index, l->mirror_sign, l->mirror_index, l->mirror_sign};
}

static void learner_open(Learner *l, int cuda, const PolicyDef *policy, const PpoDef *def,
                         int envs) {
    MildError error = {0};
    PpoMirror mirror =
        policy->observation == TOY_OBSERVATION ? toy_mirror() : some_mirror(l, policy);
    l->policy = policy_create(policy, 5, &error);
    l->pool = pool_create(cuda ? 1 : 0);
    assert_true(l->policy && l->pool);
    l->ppo = ppo_create(def, l->policy, l->pool, &mirror, envs, 11, &error);
    assert_non_null(l->ppo);
    if (cuda && gpu_learner_attach(l->ppo, &error)) {
        fail_msg("%s", error.text);
    }
}

static void learner_close(Learner *l) {
    ppo_destroy(l->ppo);
    policy_destroy(l->policy);
    pool_destroy(l->pool);
}

/* Random parameters (the modulation begins at zero otherwise) and a random rollout, the same in
 * both. */
static void fill_both(Learner *a, Learner *b, uint64_t seed) {
    Random random = random_at(seed, 1, 2);
    const Network *n = &a->policy->network;
    for (int64_t i = 0; i < n->log_std; i++) {
        a->policy->parameters[i] += (float)(0.03 * random_normal(&random));
    }
    memcpy(b->policy->parameters, a->policy->parameters, (size_t)n->count * sizeof(float));
    PpoBatch *x = ppo_batch(a->ppo);
    const int64_t samples = (int64_t)x->steps * x->envs, more = samples + x->envs;
    fill_normal(x->history, more * n->history, 1.0, &random);
    fill_normal(x->critic, more * n->def.critic_input, 1.0, &random);
    fill_normal(x->target, more * n->def.estimates, 1.0, &random);
    fill_normal(x->frame, more * n->def.observation, 1.0, &random);
    fill_normal(x->reward, samples, 1.0, &random);
    for (int64_t i = 0; i < samples; i++) {
        x->done[i] = random_unit(&random) < 0.02;
        x->timeout[i] = x->done[i] && random_unit(&random) < 0.5;
    }
    memcpy(b->ppo->batch_block, a->ppo->batch_block, a->ppo->batch_bytes);
}

/* |a - b| / |b| over a range. */
static double distance(const float *a, const float *b, int64_t count) {
    double gap = 0.0, size = 0.0;
    for (int64_t i = 0; i < count; i++) {
        gap += ((double)a[i] - b[i]) * ((double)a[i] - b[i]);
        size += (double)b[i] * b[i];
    }
    return size > 0.0 ? sqrt(gap / size) : sqrt(gap);
}

static void worse(double *worst, double value) {
    assert_true(isfinite(value));
    *worst = value > *worst ? value : *worst;
}

/* Gradients of every layer, weights and biases apart. */
static double gradient_distance(const Learner *cpu, const Learner *gpu, const char **where) {
    const Network *n = &cpu->policy->network;
    const float *a = gpu->ppo->gradient, *b = cpu->ppo->gradient;
    double worst = distance(a + n->log_std, b + n->log_std, n->def.actions);
    *where = "log_std";
    for (int i = 0; i < NETWORK_MLPS; i++) {
        const char *name;
        const Mlp *mlp = network_mlp(n, i, &name);
        for (int l = 0; l < mlp->layers; l++) {
            const MlpLayer *layer = &mlp->layer[l];
            double before = worst;
            worse(&worst,
                  distance(a + layer->weight, b + layer->weight, layer->bias - layer->weight));
            worse(&worst, distance(a + layer->bias, b + layer->bias, layer->out));
            *where = worst > before ? name : *where;
        }
    }
    return worst;
}

/* Of the means over the samples: where one nearly cancels, its error is that of numbers of size
 * 1. */
static double sums_distance(const LossSums *a, const LossSums *b, int samples) {
    const double x[] = {a->surrogate, a->kl,          a->clipped,     a->reconstruction,
                        a->vae_kl,    a->estimate[0], a->estimate[1], a->estimate[2],
                        a->mirror,    a->value};
    const double y[] = {b->surrogate, b->kl,          b->clipped,     b->reconstruction,
                        b->vae_kl,    b->estimate[0], b->estimate[1], b->estimate[2],
                        b->mirror,    b->value};
    double worst = 0.0;
    for (size_t i = 0; i < sizeof x / sizeof *x; i++) {
        worse(&worst, fabs(x[i] - y[i]) / (samples + fabs(y[i])));
    }
    return worst;
}

/* One gradient of the first `count` samples of an order, on both. */
static void compare_gradient(Learner *cpu, Learner *gpu, const int *order, int count, uint32_t draw,
                             double worst[2]) {
    PpoMinibatch minibatch = {.samples = order, .draw = draw};
    for (int s = 0; s <= PPO_SHARDS; s++) {
        minibatch.cut[s] = order_begin(count, s, PPO_SHARDS);
    }
    Learner *both[] = {cpu, gpu};
    LossSums sums[2];
    double norm[2];
    for (int k = 0; k < 2; k++) {
        Ppo *ppo = both[k]->ppo;
        const int images = ppo_mirrored(ppo, minibatch.cut, NULL);
        LossContext context = {.def = &ppo->def,
                               .network = &ppo->policy->network,
                               .mirror = &ppo->mirror,
                               .parameters = ppo->policy->parameters,
                               .sample_weight = 1.0f / (float)count,
                               .mirror_weight = images ? 1.0f / (float)images : 0.0f};
        const float *std = policy_std(ppo->policy);
        for (int j = 0; j < policy_def(ppo->policy)->actions; j++) {
            context.std[j] = std[j];
            context.old_std[j] = 1.1f * std[j];
        }
        ppo_gradient(ppo, &context, &minibatch, &sums[k], &norm[k]);
    }
    const char *where;
    double apart = gradient_distance(cpu, gpu, &where);
    print_message("  %6d samples: gradient %.1e (%s), norm %.1e, sums %.1e\n", count, apart, where,
                  fabs(norm[1] / norm[0] - 1.0), sums_distance(&sums[1], &sums[0], count));
    /* of five samples the modulation's gradient is a small difference of large numbers */
    worse(&worst[0], count < 100 ? 0.2 * apart : apart);
    worse(&worst[1], sums_distance(&sums[1], &sums[0], count));
}

static void compare_learner(const PolicyDef *policy, const PpoDef *def, int envs, double worst[4]) {
    Learner cpu, gpu;
    learner_open(&cpu, 0, policy, def, envs);
    learner_open(&gpu, 1, policy, def, envs);
    fill_both(&cpu, &gpu, 3);
    PpoBatch *a = ppo_batch(cpu.ppo), *b = ppo_batch(gpu.ppo);
    const int samples = a->steps * a->envs;
    for (int t = 0; t < a->steps; t++) {
        ppo_act(cpu.ppo, t);
        ppo_act(gpu.ppo, t);
    }
    worse(&worst[2], distance(b->mean, a->mean, (int64_t)samples * policy->actions));
    /* off the means, so that ratios leave the clip range */
    Random random = random_at(8, 8, 8);
    for (int64_t i = 0; i < samples; i++) {
        a->log_prob[i] += (float)(0.2 * random_normal(&random));
    }
    memcpy(b->mean, a->mean, (size_t)samples * (size_t)policy->actions * sizeof(float));
    memcpy(b->action, a->action, (size_t)samples * (size_t)policy->actions * sizeof(float));
    memcpy(b->log_prob, a->log_prob, (size_t)samples * sizeof(float));
    policy_value(cpu.policy, cpu.pool, samples + envs, a->critic, a->value);
    MildError error = {0};
    assert_int_equal(gpu.ppo->backend.values(gpu.ppo->backend.self, &error), MILD_OK);
    worse(&worst[3], distance(b->value, a->value, samples + envs));
    PpoReport report;
    ppo_returns(cpu.ppo, &report);
    memcpy(b->advantage, a->advantage, (size_t)samples * sizeof(float));
    memcpy(b->returns, a->returns, (size_t)samples * sizeof(float));
    int *order = malloc((size_t)samples * sizeof *order);
    assert_non_null(order);
    for (int i = 0; i < samples; i++) {
        int j = (int)random_index(&random, (uint32_t)i + 1u);
        order[i] = order[j];
        order[j] = i;
    }
    const int minibatch = ppo_largest_minibatch(cpu.ppo),
              counts[] = {minibatch, minibatch - 1, 300, 5};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        compare_gradient(&cpu, &gpu, order, counts[i] < minibatch ? counts[i] : minibatch,
                         (uint32_t)i, worst);
    }
    free(order);
    learner_close(&cpu);
    learner_close(&gpu);
}

static void test_same_function(void **state) {
    (void)state;
    double worst[4] = {0.0};
    PpoDef def = ppo_def_default();
    PolicyDef small = small_def();
    compare_learner(&small, &def, 37, worst);
    small.modulation_per_dimension = 1;
    small.latent = 3;
    def.mirror_share = 1.0;
    def.clip_value = 0;
    compare_learner(&small, &def, 37, worst);
#ifndef EMULATED
    def = ppo_def_default();
    PolicyDef full = policy_def_default();
    compare_learner(&full, &def, 256, worst);
    def.minibatches = 1; /* more rows than one chunk on the device */
    compare_learner(&full, &def, 1500, worst);
#endif
    print_message("worst against the processor: gradient %.1e, sums %.1e, means %.1e, values %.1e "
                  "(relative)\n",
                  worst[0], worst[1], worst[2], worst[3]);
    assert_true(worst[0] < 1e-5 && worst[1] < 1e-5 && worst[2] < 1e-5 && worst[3] < 1e-5);
}

/* Two runs on the device, bit for bit; and the first update stays near the processor's. */
static void test_repeats(void **state) {
    (void)state;
    PpoDef def = ppo_def_default();
#ifdef EMULATED
    PolicyDef policy = small_def();
    const int envs = 21;
    def.epochs = 1;
#else
    PolicyDef policy = policy_def_default();
    const int envs = 200;
#endif
    Learner l[3];
    PpoReport report[3];
    for (int k = 0; k < 3; k++) {
        learner_open(&l[k], k < 2, &policy, &def, envs);
        fill_both(&l[k], &l[k], 4);
        for (int t = 0; t < def.steps; t++) {
            ppo_act(l[k].ppo, t);
        }
        ppo_update(l[k].ppo, &report[k]);
        assert_int_equal(ppo_status(l[k].ppo, &(MildError){0}), MILD_OK);
    }
    const size_t bytes = (size_t)policy_parameter_count(l[0].policy) * sizeof(float);
    assert_memory_equal(policy_parameters(l[0].policy), policy_parameters(l[1].policy), bytes);
    assert_memory_equal(&report[0], &report[1], sizeof *report);
    print_message("after an update of %d steps, against the processor: parameters %.1e, value loss "
                  "%.1e (relative)\n",
                  def.epochs * def.minibatches,
                  distance(policy_parameters(l[0].policy), policy_parameters(l[2].policy),
                           policy_parameter_count(l[0].policy)),
                  fabs(report[0].value_loss / report[2].value_loss - 1.0));
    for (int k = 0; k < 3; k++) {
        learner_close(&l[k]);
    }
}

#ifdef EMULATED
/* A device that stops answering stops the learning: no step is taken with what it left behind. */
static void test_failure_stops_learning(void **state) {
    (void)state;
    PpoDef def = ppo_def_default();
    PolicyDef policy = small_def();
    Learner l;
    learner_open(&l, 1, &policy, &def, 4);
    const size_t count = (size_t)policy_parameter_count(l.policy);
    float *before = malloc(count * sizeof *before);
    assert_non_null(before);
    memcpy(before, policy_parameters(l.policy), count * sizeof *before);
    for (int t = 0; t < def.steps; t++) {
        ppo_act(l.ppo, t);
    }
    emulated_failure = 3; /* the values arrive, the first gradient does not */
    PpoReport report;
    ppo_update(l.ppo, &report);
    emulated_failure = 0;
    MildError error = {0};
    assert_int_equal(ppo_status(l.ppo, &error), MILD_ERROR_IO);
    assert_string_equal(error.text, "GPU: gradient: out of memory");
    assert_int_equal(report.skipped, def.epochs * def.minibatches);
    assert_memory_equal(before, policy_parameters(l.policy), count * sizeof *before);
    free(before);
    learner_close(&l);
}
#else
/* A checkpoint of one device goes on with the other, and learning works on both. */
static void test_learns_and_changes_device(void **state) {
    (void)state;
    const char *path = "build_test_gpu.safetensors";
    static Toy toy;
    PolicyDef policy = toy_policy_def();
    PpoDef def = ppo_def_default();
    def.steps = 40;
    def.minibatches = 2;
    MildError error = {0};
    double reward[2] = {0.0, 0.0};
    for (int part = 0; part < 2; part++) {
        Learner l;
        learner_open(&l, part == 0, &policy, &def, 64);
        if (part == 0) {
            toy_start(&toy, l.ppo);
        } else {
            assert_int_equal(ppo_load(l.ppo, path, &toy, sizeof toy, &error), MILD_OK);
        }
        for (int i = 0; i < 60; i++) {
            PpoReport report;
            toy_rollout(&toy, l.ppo);
            ppo_update(l.ppo, &report);
            reward[part] = toy.reward;
        }
        assert_int_equal(ppo_save(l.ppo, path, &toy, sizeof toy, "toy", &error), MILD_OK);
        learner_close(&l);
    }
    unlink(path);
    print_message("toy task: reward %.2f after 60 iterations on the GPU, %.2f after 60 more on the "
                  "processor\n",
                  reward[0], reward[1]);
    assert_true(reward[0] > 0.9 && reward[1] > 0.9);
}

#endif

int main(void) {
    char device[512];
    if (!gpu_device(device, sizeof device)) {
        printf("skipped: %s\n", device);
        return 77;
    }
    printf("%s\n", device);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_function),
        cmocka_unit_test(test_repeats),
#ifdef EMULATED
        cmocka_unit_test(test_failure_stops_learning),
#else
        cmocka_unit_test(test_learns_and_changes_device),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
