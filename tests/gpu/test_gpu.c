/* The learner on the GPU against the same learner on the CPU. With MILD_CUDA on the device, skipped
 * (77) where there is none; else with small networks on a stand-in for CUDA (emulated/), which runs
 * the same code of the layer. */
#include "gpu_check.h"

#include <unistd.h>

#ifdef EMULATED
extern int emulated_failure;
extern size_t emulated_memory;
#endif

/* ---- parameters ---- */

/* Every parameter keeps its value through the padded form, which holds nothing else but zeros. */
TEST(padding_is_zero_and_reversible) {
    PolicyDef def = small_def();
    Network tight, wide;
    assert_int_equal(network_layout(&tight, &def, NULL), MILD_OK);
    wide = gpu_network(&tight);
    float *from = malloc((size_t)tight.count * sizeof *from),
          *to = malloc((size_t)wide.count * sizeof *to),
          *back = calloc((size_t)tight.count, sizeof *back);
    assert_true(from && to && back);
    double sum = 0.0, padded = 0.0;
    for (int64_t i = 0; i < tight.count; i++) {
        from[i] = (float)(i + 1);
        sum += (double)from[i];
    }
    gpu_network_pad(&tight, &wide, from, to);
    for (int64_t i = 0; i < wide.count; i++) {
        padded += (double)to[i];
    }
    assert_true(sum == padded);
    gpu_network_strip(&tight, &wide, to, back);
    assert_memory_equal(from, back, (size_t)tight.count * sizeof *from);
    for (int i = 0; i < NETWORK_MLPS; i++) {
        const char *name;
        const Mlp *mlp = network_mlp(&wide, i, &name);
        for (int l = 0; l < mlp->layers; l++) {
            assert_true(mlp->layer[l].in % 8 == 0 && mlp->layer[l].out % 8 == 0);
            assert_true(mlp->layer[l].weight % 8 == 0 && mlp->layer[l].bias % 8 == 0);
            assert_true(l == 0 || mlp->layer[l].in == mlp->layer[l - 1].out);
        }
    }
    free(from);
    free(to);
    free(back);
}

/* ---- gradient ---- */

/* Gradients of every layer, weights and biases apart. */
static double gradient_distance(const Network *n, const float *a, const float *b,
                                const char **where) {
    double worst = distance(a + n->log_std, b + n->log_std, n->def.actions);
    *where = "log_std";
    for (int i = 0; i < NETWORK_MLPS; i++) {
        const char *name;
        const Mlp *mlp = network_mlp(n, i, &name);
        for (int l = 0; l < mlp->layers; l++) {
            const MlpLayer *layer = &mlp->layer[l];
            const double before = worst;
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
static double sums_distance(const double *a, const double *b, int samples) {
    double worst = 0.0;
    for (int i = 0; i < GPU_SUMS; i++) {
        worse(&worst, fabs(a[i] - b[i]) / (samples + fabs(b[i])));
    }
    return worst;
}

/* As ppo_gradient, of any samples and cuts. */
static void gradient_on_device(Learner *l, const LossContext *context,
                               const PpoMinibatch *minibatch, float *gradient, double *sums) {
    GpuLearner *g = l->gpu;
    const cudaStream_t stream = g->queue.stream;
    const Network *n = &g->network;
    const size_t samples = (size_t)g->batch.steps * (size_t)g->envs,
                 indices = (size_t)minibatch->cut[PPO_SHARDS_MAX] * sizeof(int);
    const float *log_std = g->parameters + n->log_std;
    ppo_latent_rows(minibatch->cut, 0, g->host_rows);
    ppo_mirrored(l->ppo, minibatch->cut, g->host_rows + samples);
    cudaMemcpyAsync(g->latent_row, g->host_rows, indices, cudaMemcpyHostToDevice, stream);
    cudaMemcpyAsync(g->which, g->host_rows + samples, indices, cudaMemcpyHostToDevice, stream);
    cudaMemcpyAsync(g->order, minibatch->samples, indices, cudaMemcpyHostToDevice, stream);
    gpu_begin_update(stream, l->ppo->def, n->def.actions, log_std, g->progress);
    cudaMemcpyAsync(g->progress->old_std, context->old_std, sizeof context->old_std,
                    cudaMemcpyHostToDevice, stream);
    gpu_begin_minibatch(stream, minibatch->draw, n->def.actions, log_std, g->progress);
    GpuMinibatch whole = {.samples = minibatch->cut[PPO_SHARDS_MAX],
                          .images = ppo_mirrored(l->ppo, minibatch->cut, NULL)};
    memcpy(whole.cut, minibatch->cut, sizeof whole.cut);
    gpu_enqueue_gradient(g, &whole);
    double *parts = malloc((size_t)(g->sum_blocks * GPU_SUMS) * sizeof *parts);
    assert_non_null(parts);
    cudaMemcpyAsync(g->padded, g->gradient, (size_t)n->count * sizeof(float),
                    cudaMemcpyDeviceToHost, stream);
    cudaMemcpyAsync(parts, g->sums, (size_t)(g->sum_blocks * GPU_SUMS) * sizeof *parts,
                    cudaMemcpyDeviceToHost, stream);
    assert_int_equal(cudaStreamSynchronize(stream), cudaSuccess);
    gpu_network_strip(&l->policy->network, n, g->padded, gradient);
    memset(sums, 0, GPU_SUMS * sizeof *sums);
    for (int i = 0; i < g->sum_blocks * GPU_SUMS; i++) {
        sums[i % GPU_SUMS] += parts[i];
    }
    free(parts);
}

/* One gradient of the first `count` samples of an order, on both. */
static void compare_gradient(Learner *cpu, Learner *gpu, const int *order, int count, uint32_t draw,
                             double worst[2]) {
    Ppo *ppo = cpu->ppo;
    PpoMinibatch minibatch = {.samples = order, .draw = draw};
    for (int s = 0; s <= PPO_SHARDS_MAX; s++) { /* shards of other sizes than those of an update */
        const int all = ppo->part.all, cut = s < all ? s : all;
        minibatch.cut[s] = (int)((int64_t)count * cut * cut / (all * all));
    }
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
    LossSums sums;
    double norm, device_sums[GPU_SUMS], host_sums[GPU_SUMS];
    float *gradient = malloc((size_t)ppo->policy->network.count * sizeof *gradient);
    assert_non_null(gradient);
    ppo_gradient(ppo, &context, &minibatch, &sums, &norm);
    memcpy(host_sums, &sums, sizeof host_sums);
    gradient_on_device(gpu, &context, &minibatch, gradient, device_sums);
    const char *where;
    const double apart = gradient_distance(&ppo->policy->network, gradient, ppo->gradient, &where);
    print_message("  %6d samples: gradient %.1e (%s), sums %.1e\n", count, apart, where,
                  sums_distance(device_sums, host_sums, count));
    /* of five samples the modulation's gradient is a small difference of large numbers */
    worse(&worst[0], count < 100 ? 0.2 * apart : apart);
    worse(&worst[1], sums_distance(device_sums, host_sums, count));
    free(gradient);
}

static int *some_order(int samples) {
    Random random = random_at(8, 8, 8);
    int *order = malloc((size_t)samples * sizeof *order);
    assert_non_null(order);
    for (int i = 0; i < samples; i++) {
        const int j = (int)random_index(&random, (uint32_t)i + 1u);
        order[i] = order[j];
        order[j] = i;
    }
    return order;
}

/* Two learners with the same parameters and rollout, whose actions are those of the first. Ratios
 * leave their clip range. */
static void act_both(Learner *cpu, Learner *gpu, double *apart) {
    PpoBatch *a = &cpu->batch, *b = &gpu->batch;
    const int actions = policy_def(cpu->policy)->actions, samples = a->steps * a->envs;
    for (int t = 0; t < a->steps; t++) {
        ppo_act(cpu->ppo, t);
        ppo_act(gpu->ppo, t);
    }
    learner_read(gpu);
    worse(apart, distance(b->mean, a->mean, (int64_t)samples * actions));
    worse(apart, distance(b->action, a->action, (int64_t)samples * actions));
    worse(apart, distance(b->log_prob, a->log_prob, samples));
    Random random = random_at(8, 8, 9);
    for (int64_t i = 0; i < samples; i++) {
        a->log_prob[i] += (float)(0.2 * random_normal(&random));
    }
    memcpy(b->mean, a->mean, (size_t)samples * (size_t)actions * sizeof(float));
    memcpy(b->action, a->action, (size_t)samples * (size_t)actions * sizeof(float));
    memcpy(b->log_prob, a->log_prob, (size_t)samples * sizeof(float));
    learner_write(gpu);
}

enum { MANY = 1400 };    /* environments: 33 600 samples */
static int may_fuse = 1; /* bool: products of bf16 are fused, where device and build can */
static int was_fused;    /* bool: those of the last comparison were */

static void compare_learner(const PolicyDef *policy, const PpoDef *def, int envs, int rows,
                            double worst[3]) {
    Learner cpu, gpu;
    learner_open(&cpu, ON_CPU, policy, def, envs, 0);
    learner_open(&gpu, RESIDENT, policy, def, envs, rows);
    gpu.gpu->queue.fused = may_fuse ? gpu.gpu->queue.fused : 0;
    was_fused = gpu.gpu->queue.fused != 0;
    learner_fill_parameters(&cpu, 3);
    learner_fill_parameters(&gpu, 3);
    learner_fill_rollout(&cpu, 3);
    learner_fill_rollout(&gpu, 3);
    act_both(&cpu, &gpu, &worst[2]);
    PpoBatch *a = &cpu.batch, *b = &gpu.batch;
    const int samples = a->steps * a->envs;
    Random random = random_at(4, 4, 4);
    fill_normal(a->value, samples, 1.0, &random);
    fill_normal(a->returns, samples, 1.0, &random);
    fill_normal(a->advantage, samples, 1.0, &random);
    memcpy(b->value, a->value, (size_t)samples * sizeof(float));
    memcpy(b->returns, a->returns, (size_t)samples * sizeof(float));
    memcpy(b->advantage, a->advantage, (size_t)samples * sizeof(float));
    learner_write(&gpu);
    int *order = some_order(samples);
    const int minibatch =
                  order_largest(a->steps, order_part(def->shards, a->envs, 0, 1), def->minibatches),
              counts[] = {minibatch, minibatch - 1, 300, 5};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        compare_gradient(&cpu, &gpu, order, counts[i] < minibatch ? counts[i] : minibatch,
                         (uint32_t)i, worst);
    }
    free(order);
    learner_close(&cpu);
    learner_close(&gpu);
}

TEST(gradients_are_those_of_the_cpu) {
    double worst[3] = {0.0};
    PpoDef def = ppo_def_default();
    PolicyDef small = small_def();
    compare_learner(&small, &def, 37, 100, worst); /* several chunks a minibatch */
    compare_learner(&small, &def, 37, 0, worst);
    small.modulation_per_dimension = 1;
    small.latent = 3;
    def.mirror_share = 1.0;
    def.clip_value = 0;
    compare_learner(&small, &def, 37, 100, worst);
    for (int target = PPO_TARGET_GROUND; target <= PPO_TARGET_BOTH; target++) {
        def.decoder_target = target;
        def.free_bits = 0.1; /* some dimensions below, some above */
        def.sample_latent = target == PPO_TARGET_BOTH;
        ppo_set_decoder(&def, 4, 3, &small);
        compare_learner(&small, &def, 37, 100, worst);
    }
    def.modulation = 0;
    compare_learner(&small, &def, 37, 100, worst);
    def.modulation = 1;
    small.modulation_input = POLICY_INPUT_FEET_PHASE;
    compare_learner(&small, &def, 37, 100, worst);
    small.actor_phase = 0;
    compare_learner(&small, &def, 37, 0, worst);
    small.modulation_input = POLICY_INPUT_FEET;
    compare_learner(&small, &def, 37, 100, worst);
    small.scan = 9;
    compare_learner(&small, &def, 37, 100, worst);
    small.scan = 0;
    small.latent = 270; /* rows wider than a block of threads */
    small.critic_input = 300;
    ppo_set_decoder(&def, 4, 290, &small);
    compare_learner(&small, &def, 5, 0, worst);
    /* more rows than the most slices have at once, and more blocks than a block has threads */
    small = small_def();
    def = ppo_def_default();
    def.minibatches = 1;
    compare_learner(&small, &def, MANY, 0, worst);
#ifndef EMULATED
    def = ppo_def_default();
    PolicyDef full = policy_def_default();
    compare_learner(&full, &def, 256, 0, worst);
    full.modulation_input = POLICY_INPUT_FEET_PHASE;
    full.actor_phase = 0;
    compare_learner(&full, &def, 256, 0, worst);
    full = policy_def_default();
    def.minibatches = 1;
    compare_learner(&full, &def, 1500, 0, worst);
    compare_learner(&full, &def, 1500, 10000, worst);
#endif
    print_message("worst against the CPU: gradient %.1e, sums %.1e, actions %.1e (relative)\n",
                  worst[0], worst[1], worst[2]);
    assert_true(worst[0] < 1e-5 && worst[1] < 1e-5 && worst[2] < 1e-5);
}

/* Products with rounded factors, and with bf16 rounded numbers between the layers too: near the
 * CPU's, as far as 11 or 8 bits go. The gradient of log std is a small difference of large numbers:
 * 2.6e-2 on an H100 with tf32. The stand-in has no tf32. */
static void compare_rounded(const PolicyDef *policy, int envs, int matmul, double bound,
                            double unfused) {
    PpoDef def = ppo_def_default();
    def.matmul = matmul;
    double worst[3] = {0.0};
    compare_learner(policy, &def, envs, 0, worst);
    print_message("%s: gradient %.1e, sums %.1e, actions %.1e (relative, bound %.0e)\n",
                  ppo_fields[ppo_field_count - 1].names[matmul], worst[0], worst[1], worst[2],
                  bound);
    const double gradient = was_fused ? 4e-2 : unfused; /* fused ones are rounded once */
    assert_true(worst[0] < gradient && worst[1] < bound && worst[2] < bound);
}

TEST(rounded_products_are_near) {
    const PolicyDef small = small_def();
#ifdef EMULATED
    const PolicyDef policy = small;
    const int envs = 37;
    const double unfused = 4e-2;
#else
    const PolicyDef policy = policy_def_default();
    const int envs = 256;
    const double unfused = 4e-1;
#endif
    compare_rounded(&policy, envs, PPO_MATMUL_FP32, 1e-5, 1e-5);
    compare_rounded(&policy, envs, PPO_MATMUL_TF32, 5e-3, 5e-2);
    for (may_fuse = 0; may_fuse < 2; may_fuse++) {
        compare_rounded(&policy, envs, PPO_MATMUL_BF16, 5e-2, unfused);
    }
    may_fuse = 1;
    compare_rounded(&small, MANY, PPO_MATMUL_BF16, 5e-2, unfused);
}

/* ---- update ---- */

/* Advantages, moments and substitutes of a large rollout, of which any share may be valid. */
static void compare_returns(double valid) {
    enum { ENVS = 701 };
    PpoDef def = ppo_def_default();
    PolicyDef policy = small_def();
    Learner cpu, gpu;
    learner_open(&cpu, ON_CPU, &policy, &def, ENVS, 0);
    learner_open(&gpu, RESIDENT, &policy, &def, ENVS, 100);
    learner_fill_rollout(&cpu, 5);
    learner_fill_rollout(&gpu, 5);
    PpoBatch *a = &cpu.batch, *b = &gpu.batch;
    const int samples = def.steps * ENVS;
    Random random = random_at(6, 6, 6);
    fill_normal(a->value, samples + ENVS, 1.0, &random);
    for (int i = 0; i < samples; i++) {
        a->valid[i] = random_unit(&random) < valid;
        a->reward[i] = a->valid[i] && i % 97 == 0 ? NAN : a->reward[i];
    }
    memcpy(b->value, a->value, (size_t)(samples + ENVS) * sizeof(float));
    memcpy(b->reward, a->reward, (size_t)samples * sizeof(float));
    memcpy(b->valid, a->valid, (size_t)samples);
    learner_write(&gpu);
    PpoReport report = {0};
    ppo_returns(cpu.ppo, &report);
    GpuLearner *g = gpu.gpu;
    const cudaStream_t stream = g->queue.stream;
    gpu_begin_update(stream, def, policy.actions, g->parameters + g->network.log_std, g->progress);
    gpu_enqueue_returns(g);
    GpuProgress progress;
    int *substitute = malloc((size_t)samples * sizeof *substitute);
    assert_non_null(substitute);
    cudaMemcpyAsync(&progress, g->progress, sizeof progress, cudaMemcpyDeviceToHost, stream);
    cudaMemcpyAsync(substitute, g->substitute, (size_t)samples * sizeof *substitute,
                    cudaMemcpyDeviceToHost, stream);
    learner_read(&gpu);
    assert_memory_equal(substitute, cpu.ppo->substitute, (size_t)samples * sizeof *substitute);
    assert_int_equal(progress.starved, cpu.ppo->starved);
    assert_int_equal(progress.starved, valid == 0.0);
    for (int i = 0; i < samples; i++) {
        assert_true(fabs((double)(b->returns[i] - a->returns[i])) < 1e-5);
        assert_true(fabs((double)(b->advantage[i] - a->advantage[i])) < 1e-5);
    }
    assert_close("mean value", progress.report.value_mean, report.value_mean, 1e-12);
    assert_close("deviation", progress.report.advantage_std, report.advantage_std, 1e-9);
    assert_close("explained", progress.report.explained_variance, report.explained_variance, 1e-9);
    free(substitute);
    learner_close(&cpu);
    learner_close(&gpu);
}

TEST(returns_are_those_of_the_cpu) {
    static const double shares[] = {1.0, 0.9, 0.3, 0.01, 0.0};
    for (size_t i = 0; i < sizeof shares / sizeof *shares; i++) {
        compare_returns(shares[i]);
    }
}

/* A step of Adam moves a parameter by rate * m / sqrt(v). With v from a run that has learned, that
 * is smooth in the gradient, whose rounding is 1e-5 of its size. Every step begins where the last
 * one ended, so the differences add up; 1e-3 of the way is far above that and far below any step
 * that is missing or wrong. */
TEST(updates_are_those_of_the_cpu) {
    PpoDef def = ppo_def_default();
    PolicyDef policy = small_def();
    double worst = 0.0;
    def.average = 0.9;
    for (int fault = 0; fault < FAULTS; fault++) {
        worse(&worst,
              compare_update(RESIDENT, &policy, &def, 37, fault == NOTHING ? 100 : 0, fault, NULL));
    }
    def.decoder_target = PPO_TARGET_NEWEST;
    def.average = 0.0;
    def.kl_target = 0.0;
    def.minibatches = 3;
    def.max_gradient_norm = 0.05;
    def.std_min = 0.99; /* the noise meets its floor at a step and its ceiling at the end */
    def.std_max[0] = def.std_max[1] = 0.7;
    worse(&worst, compare_update(RESIDENT, &policy, &def, 5, 0, NOTHING, NULL));
    def = ppo_def_default();
    def.minibatches = def.epochs = 1;
    worse(&worst, compare_update(RESIDENT, &policy, &def, MANY, 0, NOTHING, NULL));
    def = ppo_def_default();
    def.shards = PPO_SHARDS_MAX; /* some of no environment */
    worse(&worst, compare_update(RESIDENT, &policy, &def, 37, 0, INVALID, NULL));
    def = ppo_def_default();
    for (int target = 0; target < PPO_TARGETS; target++) {
        for (int noise = 0; noise < 2; noise++) {
            PolicyDef other = small_def();
            def.decoder_target = target;
            def.target_noise = noise;
            def.sample_latent = noise;
            ppo_set_decoder(&def, 4, 3, &other);
            worse(&worst, compare_update(RESIDENT, &other, &def, 5, 0, INVALID, NULL));
        }
    }
#ifndef EMULATED
    PolicyDef full = policy_def_default();
    def = ppo_def_default();
    worse(&worst, compare_update(RESIDENT, &full, &def, 256, 0, NOTHING, NULL));
    worse(&worst, compare_update(RESIDENT, &full, &def, 256, 0, INVALID, NULL));
#endif
    print_message("way of the parameters in an update, against the CPU's: %.1e (relative)\n",
                  worst);
    assert_true(worst < 1e-3);
}

/* Muon's steps too. Matrices have more rows than columns or fewer, and widths that are padded on
 * the device. */
TEST(updates_of_muon_are_those_of_the_cpu) {
    PpoDef def = ppo_def_default();
    PolicyDef policy = small_def();
    double worst = 0.0;
    def.optimizer = PPO_OPTIMIZER_MUON;
    def.average = 0.9;
    for (int fault = 0; fault < FAULTS; fault++) {
        worse(&worst,
              compare_update(RESIDENT, &policy, &def, 37, fault == NOTHING ? 100 : 0, fault, NULL));
    }
    def.max_gradient_norm = 0.05;
    worse(&worst, compare_update(RESIDENT, &policy, &def, 5, 0, NOTHING, NULL));
    policy.actor_hidden[1] = policy.critic_hidden[1] = policy.encoder_hidden[1] =
        policy.decoder_hidden[1] = 0; /* no matrix between hidden layers */
    policy.actor_hidden[2] = policy.critic_hidden[2] = 0;
    worse(&worst, compare_update(RESIDENT, &policy, &def, 5, 0, NOTHING, NULL));
#ifndef EMULATED
    PolicyDef full = policy_def_default();
    def = ppo_def_default();
    def.optimizer = PPO_OPTIMIZER_MUON;
    worse(&worst, compare_update(RESIDENT, &full, &def, 256, 0, NOTHING, NULL));
#endif
    print_message("way of the parameters in an update by Muon, against the CPU's: %.1e "
                  "(relative)\n",
                  worst);
    assert_true(worst < 1e-3);
}

/* Two runs on the device, bit for bit, and a third with the rollout on the CPU. */
TEST(runs_repeat) {
    PpoDef def = ppo_def_default();
    def.average = 0.9;
#ifdef EMULATED
    PolicyDef policy = small_def();
    const int envs = 21;
    def.epochs = 2;
#else
    PolicyDef policy = policy_def_default();
    const int envs = 200;
#endif
    Learner l[3];
    PpoReport report[3];
    for (int k = 0; k < 3; k++) {
        learner_open(&l[k], k < 2 ? RESIDENT : MIXED, &policy, &def, envs, 0);
        learner_fill_parameters(&l[k], 4);
        for (int round = 0; round < 3; round++) {
            learner_fill_rollout(&l[k], (uint64_t)round);
            for (int t = 0; t < def.steps; t++) {
                ppo_act(l[k].ppo, t);
            }
            report[k] = learner_update(&l[k]);
        }
        learner_pull(&l[k]);
        assert_int_equal(ppo_iteration(l[k].ppo), 3);
    }
    const size_t bytes = (size_t)policy_parameter_count(l[0].policy) * sizeof(float);
    for (int k = 1; k < 3; k++) {
        assert_memory_equal(policy_parameters(l[0].policy), policy_parameters(l[k].policy), bytes);
        assert_memory_equal(policy_parameters(ppo_average(l[0].ppo)),
                            policy_parameters(ppo_average(l[k].ppo)), bytes);
        assert_memory_equal(&report[0], &report[k], sizeof *report);
    }
    for (int k = 0; k < 3; k++) {
        learner_close(&l[k]);
    }
}

/* ---- learning ---- */

static void assert_same_state(const Learner *a, const Learner *b) {
    const Network *n = &a->policy->network;
    const size_t bytes = (size_t)n->count * sizeof(float), envs = (size_t)a->batch.envs;
    assert_memory_equal(a->policy->parameters, b->policy->parameters, bytes);
    assert_memory_equal(a->ppo->first, b->ppo->first, bytes);
    assert_memory_equal(a->ppo->second, b->ppo->second, bytes);
    assert_memory_equal(a->ppo->start.history, b->ppo->start.history,
                        envs * (size_t)n->history * sizeof(float));
    assert_memory_equal(a->ppo->start.critic, b->ppo->start.critic,
                        envs * (size_t)n->def.critic_input * sizeof(float));
    assert_true(a->ppo->iteration == b->ppo->iteration);
    assert_true(a->ppo->adam_steps == b->ppo->adam_steps);
    assert_true(a->ppo->learning_rate == b->ppo->learning_rate);
    assert_true(a->ppo->seed == b->ppo->seed);
}

static uint64_t device_seed(const Learner *l) {
    uint64_t seed = l->ppo->seed;
    if (l->gpu) {
        cudaMemcpyAsync(&seed, &l->gpu->progress->seed, sizeof seed, cudaMemcpyDeviceToHost,
                        l->gpu->queue.stream);
        assert_int_equal(cudaStreamSynchronize(l->gpu->queue.stream), cudaSuccess);
    }
    return seed;
}

/* A checkpoint of one device goes on with the other as it was, and learning works on both. */
TEST(learns_and_changes_device) {
    const char *path = "build_test_gpu.safetensors";
    static Toy toy;
    PolicyDef policy = toy_policy_def();
    PpoDef def = toy_ppo_def();
    MildError error = {0};
#ifdef EMULATED
    static const int where[] = {RESIDENT, ON_CPU, RESIDENT}, iterations[] = {50, 30, 2};
#else
    static const int where[] = {RESIDENT, ON_CPU, MIXED}, iterations[] = {60, 30, 30};
#endif
    Learner l[3];
    double reward[3];
    for (int part = 0; part < 3; part++) {
        learner_open(&l[part], where[part], &policy, &def, 32, 0);
        if (part == 0) {
            l[0].ppo->seed = 12;
            learner_push(&l[0]);
            learner_start_toy(&l[0], &toy);
        } else {
            assert_int_equal(ppo_load(l[part].ppo, path, &toy, sizeof toy, &error), MILD_OK);
            assert_true(device_seed(&l[part]) == 12); /* not that of this run */
            learner_read(&l[part]);
            learner_pull(&l[part]); /* what the device holds */
            assert_same_state(&l[part - 1], &l[part]);
        }
        reward[part] = learner_play(&l[part], &toy, iterations[part]);
        assert_int_equal(ppo_save(l[part].ppo, path, &toy, sizeof toy, "toy", &error), MILD_OK);
    }
    unlink(path);
    Learner alone; /* on the CPU from the start */
    learner_open(&alone, ON_CPU, &policy, &def, 32, 0);
    learner_start_toy(&alone, &toy);
    const double expected = learner_play(&alone, &toy, iterations[0]);
    print_message("toy task: reward %.2f after %d iterations on the GPU (%.2f on the CPU), %.2f "
                  "after %d more on the CPU, %.2f after %d more on the GPU\n",
                  reward[0], iterations[0], expected, reward[1], iterations[1], reward[2],
                  iterations[2]);
    assert_true(reward[0] > 0.9 && reward[1] > 0.9 && reward[2] > 0.9);
    assert_true(fabs(reward[0] - expected) < 0.05);
    learner_close(&alone);
    for (int part = 0; part < 3; part++) {
        learner_close(&l[part]);
    }
}

/* ---- failures ---- */

#ifdef EMULATED
/* A device that stops answering stops the learning, and says so. */
TEST(a_failure_stops_learning) {
    PpoDef def = ppo_def_default();
    PolicyDef policy = small_def();
    for (int where = MIXED; where <= RESIDENT; where++) {
        Learner l;
        learner_open(&l, where, &policy, &def, 4, 0);
        for (int t = 0; t < def.steps; t++) {
            ppo_act(l.ppo, t);
        }
        emulated_failure = 1;
        PpoReport report;
        ppo_update(l.ppo, &report);
        emulated_failure = 0;
        MildError error = {0};
        assert_refused(ppo_status(l.ppo, &error), MILD_ERROR_IO, &error, "GPU update");
        assert_int_equal(ppo_iteration(l.ppo), 0);
        learner_close(&l);
    }
}

static MildStatus attach(int envs, MildError *error) {
    PpoDef def = ppo_def_default();
    PolicyDef policy_def = small_def();
    Policy *policy = policy_create(&policy_def, 5, error);
    Pool *pool = pool_create(1);
    Ppo *ppo = ppo_create(&def, policy, pool, NULL, envs, 11, error);
    assert_non_null(ppo);
    const MildStatus status = gpu_learner_attach(ppo, &(GpuLearnerDef){.resident = 1}, error);
    ppo_destroy(ppo);
    policy_destroy(policy);
    pool_destroy(pool);
    return status;
}

/* Too little memory: the line says how many robots fit, and so many do, but not one more. */
TEST(missing_memory_is_reported) {
    MildError error = {0};
    emulated_memory = (size_t)40 << 20;
    assert_int_equal(attach(5000, &error), MILD_ERROR_MEMORY);
    print_message("%s\n", error.text);
    char *end = strrchr(error.text, ';'); /* N robots; the remedy */
    assert_non_null(end);
    while (end > error.text && !isdigit((unsigned char)end[-1])) {
        end--;
    }
    while (end > error.text && isdigit((unsigned char)end[-1])) {
        end--;
    }
    const int robots = atoi(end);
    assert_error(&error, MILD_ERROR_MEMORY, "5000 24 train.envs ppo.steps");
    assert_true(robots > 100 && robots < 5000);
    assert_int_equal(attach(robots, &error), MILD_OK);
    assert_int_equal(attach(robots + 1, &error), MILD_ERROR_MEMORY);
    emulated_memory = (size_t)1 << 34;
}

#else

/* A rollout of acts, captured once, is right in every iteration. */
TEST(acts_are_captured) {
    PpoDef def = ppo_def_default();
    PolicyDef policy = policy_def_default();
    Learner l[2];
    cudaGraph_t graph = NULL;
    cudaGraphExec_t exec = NULL;
    for (int k = 0; k < 2; k++) {
        learner_open(&l[k], RESIDENT, &policy, &def, 200, 0);
        learner_fill_parameters(&l[k], 4);
        const cudaStream_t stream = gpu_learner_stream(l[k].ppo);
        if (k == 1) {
            assert_int_equal(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal),
                             cudaSuccess);
            for (int t = 0; t < def.steps; t++) {
                ppo_act(l[k].ppo, t);
            }
            assert_int_equal(cudaStreamEndCapture(stream, &graph), cudaSuccess);
            assert_int_equal(cudaGraphInstantiate(&exec, graph, 0), cudaSuccess);
        }
        for (int round = 0; round < 3; round++) {
            learner_fill_rollout(&l[k], (uint64_t)round);
            for (int t = 0; k == 0 && t < def.steps; t++) {
                ppo_act(l[k].ppo, t);
            }
            if (k == 1) {
                assert_int_equal(cudaGraphLaunch(exec, stream), cudaSuccess);
            }
            learner_update(&l[k]);
        }
        learner_pull(&l[k]);
    }
    assert_non_null(l[0].gpu->graph);
    assert_memory_equal(policy_parameters(l[0].policy), policy_parameters(l[1].policy),
                        (size_t)policy_parameter_count(l[0].policy) * sizeof(float));
    cudaGraphExecDestroy(exec);
    cudaGraphDestroy(graph);
    learner_close(&l[0]);
    learner_close(&l[1]);
}

#endif

int main(void) {
    char device[512];
    if (!gpu_device(device, sizeof device)) {
        printf("skipped: %s\n", device);
        return 77;
    }
    printf("%s\n", device);
    return run_cases(NULL, NULL);
}
