/* The update around the gradient: learning rate, anneal, clipping, bounds of the noise, averages,
 * order, the report. Scripted results stand in for the networks (the linker puts the functions
 * below in place of policy_value_rows and ppo_gradient), so that every number is known. */
#include "check.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "learn/ppo.h"
#include "learn/ppo_gradient.h"
#include "learn/ppo_step.h"

enum { STEPS = 6, ENVS = 5, SAMPLES = STEPS * ENVS, CALLS = 64 };

typedef struct {
    const PpoBatch *batch;
    LossSums sums; /* per sample: what every call returns, times the count of samples */
    float gradient;
    int bad_at;       /* call whose kl is no number; -1: none */
    float value;      /* of every sample */
    int half_rewards; /* bool: or half of its reward */
    /* what was asked */
    int calls, values;
    int count[CALLS], samples[CALLS][SAMPLES];
    uint64_t key[CALLS];
    LossContext context;
} Script;

static Script *script; /* of the run that is open */

WRAPS(policy_value_rows);
WRAPS(ppo_gradient);

void __wrap_policy_value_rows(Policy *policy, Pool *pool, const PolicyRows *rows,
                              const float *critic, float *values) {
    const int count = rows->blocks * rows->cut[rows->runs];
    (void)policy;
    (void)pool;
    (void)critic;
    assert_int_equal(count, (STEPS + 1) * ENVS);
    for (int i = 0; i < count; i++) {
        values[i] = !script->half_rewards ? script->value
                    : i < SAMPLES         ? 0.5f * script->batch->reward[i]
                                          : 0.0f;
    }
    script->values++;
}

void __wrap_ppo_gradient(Ppo *ppo, const LossContext *context, const PpoMinibatch *minibatch,
                         LossSums *sums, double *norm) {
    Script *s = script;
    const int call = s->calls++, count = minibatch->cut[PPO_SHARDS_MAX];
    if (call < CALLS) {
        s->count[call] = count;
        s->key[call] = step_latent_key(ppo->seed, ppo->iteration, minibatch->draw);
        memcpy(s->samples[call], minibatch->samples, (size_t)count * sizeof *minibatch->samples);
    }
    s->context = *context;
    for (int64_t i = 0; i < context->network->count; i++) {
        ppo->gradient[i] = s->gradient;
    }
    *norm = sqrt((double)context->network->count) * fabs((double)s->gradient);
    const double n = count;
    *sums = (LossSums){n * s->sums.surrogate,
                       call == s->bad_at ? NAN : n * s->sums.kl,
                       n * s->sums.clipped,
                       n * s->sums.reconstruction,
                       n * s->sums.vae_kl,
                       {n * s->sums.estimate[0], n * s->sums.estimate[1], n * s->sums.estimate[2]},
                       n * s->sums.mirror,
                       n * s->sums.value};
}

typedef struct {
    Policy *policy;
    Pool *pool;
    Ppo *ppo;
    Script script;
} Run;

/* One epoch of one minibatch unless the def says otherwise. */
static PpoDef plain_def(void) {
    PpoDef def = ppo_def_default();
    def.steps = STEPS;
    def.epochs = def.minibatches = 1;
    def.learning_rate = 1e-3;
    def.learning_rate_min = 1e-5;
    def.learning_rate_max = 2e-3;
    def.kl_target = 0.01;
    return def;
}

static void run_open(Run *run, PpoDef def, const PpoMirror *mirror) {
    MildError error = {0};
    PolicyDef policy_def = small_def();
    memset(run, 0, sizeof *run);
    run->policy = policy_create(&policy_def, 1, &error);
    run->pool = pool_create(1);
    run->ppo = ppo_create(&def, run->policy, run->pool, mirror, ENVS, 17, &error);
    assert_non_null(run->ppo);
    run->script = (Script){.batch = ppo_batch(run->ppo), .gradient = 1e-4f, .bad_at = -1};
    script = &run->script;
}

static void run_close(Run *run) {
    ppo_destroy(run->ppo);
    policy_destroy(run->policy);
    pool_destroy(run->pool);
}

static PpoReport update(Run *run) {
    PpoReport report;
    ppo_update(run->ppo, &report);
    return report;
}

static void assert_close(const char *what, double ours, double expected, double relative) {
    if (!(fabs(ours - expected) <= relative * fmax(fabs(expected), 1e-30))) {
        fail_msg("%s: %.12g, by hand %.12g", what, ours, expected);
    }
}

/* ---- learning rate ---- */

static double rate_after(double kl, double rate, PpoDef def, int64_t iteration) {
    Run run;
    def.learning_rate = rate;
    run_open(&run, def, NULL);
    run.ppo->iteration = iteration;
    run.script.sums.kl = kl;
    double after = update(&run).learning_rate;
    assert_int_equal(run.script.calls, 1);
    run_close(&run);
    return after;
}

/* Above twice the target the rate is divided by 1.5, below half of it multiplied, between them it
 * stays; a divergence that is rounding says nothing. */
TEST(rate_follows_the_divergence) {
    const PpoDef def = plain_def();
    assert_close("far above", rate_after(1.0, 9e-4, def, 0), 6e-4, 1e-12);
    assert_close("just above twice", rate_after(0.0201, 9e-4, def, 0), 6e-4, 1e-12);
    assert_close("just below twice", rate_after(0.0199, 9e-4, def, 0), 9e-4, 1e-12);
    assert_close("just above half", rate_after(0.0051, 9e-4, def, 0), 9e-4, 1e-12);
    assert_close("just below half", rate_after(0.0049, 9e-4, def, 0), 1.35e-3, 1e-12);
    assert_close("zero", rate_after(0.0, 9e-4, def, 0), 9e-4, 1e-12);
    assert_close("rounding", rate_after(0.9e-8, 9e-4, def, 0), 9e-4, 1e-12);
    assert_close("just above it", rate_after(1.1e-8, 9e-4, def, 0), 1.35e-3, 1e-12);
    assert_close("negative by rounding", rate_after(-1e-9, 9e-4, def, 0), 9e-4, 1e-12);
    assert_close("upper bound", rate_after(1e-4, 1.5e-3, def, 0), 2e-3, 1e-12);
    assert_close("lower bound", rate_after(1.0, 1.2e-5, def, 0), 1e-5, 1e-12);
    assert_close("from above the bound", rate_after(0.01, 9e-3, def, 0), 2e-3, 1e-12);
    assert_close("from below the bound", rate_after(0.01, 1e-6, def, 0), 1e-5, 1e-12);
    PpoDef fixed = def;
    fixed.kl_target = 0.0;
    assert_close("fixed", rate_after(1.0, 9e-3, fixed, 0), 9e-3, 1e-12);
}

/* Every minibatch adapts, and its own step already takes the new rate: Adam's first step moves each
 * parameter by the rate against the gradient's sign. */
TEST(rate_is_adapted_before_the_step) {
    Run run;
    PpoDef def = plain_def();
    run_open(&run, def, NULL);
    run.script.sums.kl = 0.05;
    float before = policy_parameters(run.policy)[7];
    update(&run);
    assert_close("first step", (double)(before - policy_parameters(run.policy)[7]), 1e-3 / 1.5,
                 1e-3);
    run_close(&run);
    def.epochs = 2;
    def.minibatches = 3;
    run_open(&run, def, NULL);
    run.script.sums.kl = 0.05;
    assert_close("six minibatches", update(&run).learning_rate, 1e-3 / pow(1.5, 6), 1e-12);
    assert_int_equal(run.ppo->adam_steps, 6);
    run_close(&run);
}

/* Between iterations 10 and 20 the target and the greatest rate fall by the factor 0.01: half way
 * by 0.1, so that 0.0021 is above twice 0.001 and 2e-4 is the greatest rate. */
TEST(anneal_lowers_target_and_greatest_rate) {
    PpoDef def = plain_def();
    def.anneal[0] = 10, def.anneal[1] = 20;
    def.anneal_factor = 0.01;
    static const struct {
        int iteration;
        double share;
    } at[] = {{0, 0.0}, {10, 0.0}, {12, 0.2}, {15, 0.5}, {20, 1.0}, {40, 1.0}};
    for (size_t i = 0; i < sizeof at / sizeof *at; i++) {
        double factor = pow(0.01, at[i].share), target = 0.01 * factor, most = 2e-3 * factor;
        double rate = 0.9 * most;
        assert_close("above twice", rate_after(2.01 * target, rate, def, at[i].iteration),
                     fmax(rate / 1.5, 1e-5), 1e-9);
        assert_close("between", rate_after(1.99 * target, rate, def, at[i].iteration), rate, 1e-9);
        assert_close("below half", rate_after(0.49 * target, rate, def, at[i].iteration), most,
                     1e-9);
    }
    def.learning_rate_min = 1e-4; /* the least rate is stronger than the anneal */
    assert_close("bounds meet", rate_after(1e-9, 1e-4, def, 20), 1e-4, 1e-12);
    def.anneal[0] = 30; /* last before first: none */
    assert_close("no anneal", rate_after(0.01, 1e-3, def, 40), 1e-3, 1e-12);
}

/* ---- the step ---- */

/* A gradient longer than the greatest norm is shortened to it; a shorter one is taken as it is.
 * Adam's first moment after one step is a tenth of what it was given. */
TEST(gradient_is_shortened_to_the_greatest_norm) {
    for (int longer = 0; longer < 2; longer++) {
        Run run;
        PpoDef def = plain_def();
        run_open(&run, def, NULL);
        const double count = (double)policy_parameter_count(run.policy);
        const double norm = longer ? 4.0 : 0.9;
        run.script.gradient = (float)(norm / sqrt(count));
        PpoReport report = update(&run);
        assert_close("norm", report.gradient_norm, norm, 1e-5);
        for (int64_t i = 0; i < policy_parameter_count(run.policy); i++) {
            assert_close("first moment", (double)run.ppo->first[i],
                         0.1 * (longer ? 1.0 : 0.9) / sqrt(count), 1e-4);
        }
        run_close(&run);
    }
}

/* Of equal gradients c a matrix has one direction, of singular value 1 at length 1: its step is
 * the rate times 0.2 sqrt(max(rows, columns)) f(1) / sqrt(rows columns), whatever c. Momentum is c,
 * then c + 0.95 c. All else moves as by Adam. */
TEST(muon_moves_what_lies_between_hidden_layers) {
    Run run;
    PpoDef def = plain_def();
    double f = 1.0;
    for (int k = 0; k < 5; k++) {
        f = 3.4445 * f - 4.7750 * f * f * f + 2.0315 * pow(f, 5);
    }
    def.optimizer = PPO_OPTIMIZER_MUON;
    def.epochs = 2;
    run_open(&run, def, NULL);
    run.script.sums.kl = 0.01; /* the rate stays 1e-3 */
    const int64_t count = policy_parameter_count(run.policy);
    run.script.gradient = (float)(4.0 / sqrt((double)count)); /* shortened to 1 / sqrt(count) */
    const double c = 1.0 / sqrt((double)count);
    float *before = malloc((size_t)count * sizeof *before);
    assert_non_null(before);
    memcpy(before, policy_parameters(run.policy), (size_t)count * sizeof *before);
    update(&run);
    const MuonMatrices muon = muon_matrices(&run.policy->network);
    for (int64_t i = 0; i < count; i++) {
        double step = 1e-3, first = (0.1 + 0.09) * c, second = (0.001 + 0.000999) * c * c;
        for (int m = 0; m < muon.count; m++) {
            const double rows = muon.matrix[m].rows, columns = muon.matrix[m].columns;
            if (i >= muon.matrix[m].at && i < muon.matrix[m].at + (int64_t)(rows * columns)) {
                step *= 0.2 * sqrt(fmax(rows, columns) / (rows * columns)) * f;
                first = 1.95 * c;
                second = 0.0;
            }
        }
        assert_true(fabs((double)(before[i] - policy_parameters(run.policy)[i]) - 2.0 * step) <
                    1e-6);
        assert_close("momentum", (double)run.ppo->first[i], first, 1e-4);
        assert_close("second moment", (double)run.ppo->second[i], second, 1e-4);
    }
    free(before);
    run_close(&run);
}

/* Every sum that is not a number costs its minibatch and nothing else; so does a norm. */
TEST(bad_sums_cost_their_minibatch) {
    for (int bad = 0; bad < 10; bad++) {
        Run run;
        run_open(&run, plain_def(), NULL);
        LossSums *s = &run.script.sums;
        double *const sums[] = {&s->surrogate,   &s->kl,          &s->reconstruction,
                                &s->vae_kl,      &s->estimate[0], &s->estimate[1],
                                &s->estimate[2], &s->mirror,      &s->value};
        if (bad < 9) {
            *sums[bad] = bad % 2 ? NAN : INFINITY;
        } else {
            run.script.gradient = NAN;
        }
        float *before = calloc((size_t)policy_parameter_count(run.policy), sizeof *before);
        size_t bytes = (size_t)policy_parameter_count(run.policy) * sizeof *before;
        memcpy(before, policy_parameters(run.policy), bytes);
        PpoReport report = update(&run);
        assert_int_equal(report.skipped, 1);
        assert_int_equal(run.ppo->adam_steps, 0);
        assert_memory_equal(before, policy_parameters(run.policy), bytes);
        assert_true(report.surrogate == 0.0 && report.gradient_norm == 0.0 && report.kl == 0.0);
        assert_true(report.learning_rate == 1e-3);
        free(before);
        run_close(&run);
    }
}

/* The device is lost in the second update: the error stays, and the policy with it. */
static MildStatus update_once(void *self, PpoReport *report, MildError *error) {
    int *calls = self;
    report->skipped = 3;
    return (*calls)++ > 0 ? mild_fail(error, MILD_ERROR_IO, "the device is gone") : MILD_OK;
}

TEST(a_backend_that_fails_is_reported) {
    Run run;
    MildError error = {0};
    int calls = 0;
    run_open(&run, plain_def(), NULL);
    ppo_use(run.ppo, &(PpoBackend){.self = &calls, .update = update_once});
    assert_int_equal(update(&run).skipped, 3);
    assert_int_equal(ppo_status(run.ppo, &error), MILD_OK);
    update(&run);
    assert_refused(ppo_status(run.ppo, &error), MILD_ERROR_IO, &error, "device");
    assert_int_equal(calls, 2);
    assert_int_equal(run.script.calls, 0);
    run_close(&run);
}

/* ---- the report ---- */

/* Means over the minibatches that were taken, each a mean over its samples. */
TEST(report_has_means) {
    Run run;
    PpoDef def = plain_def();
    def.epochs = 2;
    def.minibatches = 4;
    run_open(&run, def, NULL);
    run.script.bad_at = 3; /* a skipped one changes no mean */
    run.script.sums = (LossSums){0.5, 0.01, 0.25, 1.5, 2.5, {0.1, 0.2, 0.3}, 0.7, 3.5};
    for (int j = 0; j < 2; j++) {
        run.policy->parameters[run.policy->network.log_std + j] = logf(j ? 0.5f : 2.0f);
    }
    run.script.gradient = 0.0f;
    PpoReport report = update(&run);
    assert_int_equal(report.skipped, 1);
    assert_int_equal(run.script.calls, 8);
    assert_close("surrogate", report.surrogate, 0.5, 1e-6);
    assert_close("kl", report.kl, 0.01, 1e-6);
    assert_close("clip share", report.clip_share, 0.25, 1e-6);
    assert_close("reconstruction", report.vae_reconstruction, 1.5, 1e-6);
    assert_close("vae kl", report.vae_kl, 2.5, 1e-6);
    for (int g = 0; g < 3; g++) {
        assert_close("estimates", report.estimate_loss[g], 0.1 * (g + 1), 1e-6);
    }
    assert_close("value", report.value_loss, 3.5, 1e-6);
    assert_true(report.mirror == 0.0); /* no sample has an image */
    /* log 2 + log 1/2 cancel: two dimensions of (1 + ln 2 pi)/2 */
    assert_close("entropy", report.entropy, 2.8378770664093453, 1e-6);
    assert_close("std", report.action_std, 1.25, 1e-6);
    assert_true(report.gradient_norm == 0.0);
    run_close(&run);
}

/* Half of each shard's samples have an image: five shards of 6 samples, three without any. */
TEST(mirror_is_averaged_over_the_images) {
    Run run;
    PpoDef def = plain_def();
    const PpoMirror mirror = small_mirror();
    run_open(&run, def, &mirror);
    run.script.sums.mirror = 0.8; /* times 30 samples: a sum of 24 */
    PpoReport report = update(&run);
    int which[SAMPLES];
    int cut[PPO_SHARDS_MAX + 1];
    assert_int_equal(order_cuts(def.shards, STEPS, ENVS, 0, 1, cut), SAMPLES);
    const int images = ppo_mirrored(run.ppo, cut, which);
    assert_int_equal(images, 15);
    for (int r = 1; r < images; r++) {
        assert_true(which[r] > which[r - 1] && which[r] < SAMPLES);
    }
    assert_close("mirror", report.mirror, 24.0 / 15, 1e-6);
    assert_close("weight", (double)run.script.context.mirror_weight, 1.0 / 15, 1e-6);
    assert_close("sample weight", (double)run.script.context.sample_weight, 1.0 / SAMPLES, 1e-6);
    run_close(&run);
    def.mirror_weight = 0.0;
    run_open(&run, def, &mirror);
    update(&run);
    assert_null(run.script.context.mirror);
    assert_true(run.script.context.mirror_weight == 0.0f);
    run_close(&run);
}

/* Rewards 1, 2, 3, ... and values of 0.5 without a future: the advantage is r - 0.5, the return r.
 */
TEST(values_and_explained_variance) {
    Run run;
    PpoDef def = plain_def();
    def.gamma = 0.0;
    run_open(&run, def, NULL);
    run.script.value = 0.5f;
    PpoBatch *b = ppo_batch(run.ppo);
    for (int i = 0; i < SAMPLES; i++) {
        b->reward[i] = (float)(i % 2);
        b->valid[i] = 1;
    }
    PpoReport report = update(&run);
    assert_int_equal(run.script.values, 1);
    assert_close("mean value", report.value_mean, 0.5, 1e-6);
    assert_close("deviation of the advantage", report.advantage_std, 0.5, 1e-6);
    assert_true(fabs(report.explained_variance) < 1e-6); /* a constant explains nothing */
    for (int i = 0; i < SAMPLES; i++) {
        assert_close("normalised", (double)b->advantage[i], i % 2 ? 1.0 : -1.0, 1e-6);
        assert_true(b->returns[i] == (float)(i % 2));
    }
    run.script.half_rewards = 1; /* the other half remains: 1 - (1/2)^2 */
    for (int i = 0; i < SAMPLES; i++) {
        b->reward[i] = (float)(i * i % 7);
    }
    assert_close("half", update(&run).explained_variance, 0.75, 1e-6);
    for (int i = 0; i < SAMPLES; i++) {
        b->reward[i] = 3.0f; /* returns that do not vary cannot be explained */
    }
    assert_true(update(&run).explained_variance == 0.0);
    run_close(&run);
}

/* ---- order of the samples ---- */

/* Each of 30 samples once an epoch, and the two that are not valid replaced by the next step of
 * their environment, which is a stratum of its own here. */
TEST(every_sample_once_an_epoch) {
    Run run;
    PpoDef def = plain_def();
    def.epochs = 3;
    def.minibatches = 4;
    run_open(&run, def, NULL);
    PpoBatch *b = ppo_batch(run.ppo);
    b->valid[3] = b->valid[SAMPLES - 1] = 0;
    update(&run);
    assert_int_equal(run.script.calls, 12);
    static const int sizes[4] = {5, 10, 5, 10}; /* of 6 samples a stratum: 1, 2, 1, 2 */
    int epochs[3][SAMPLES], same = 0;
    for (int epoch = 0; epoch < 3; epoch++) {
        int seen[SAMPLES] = {0}, k = 0;
        for (int m = 0; m < 4; m++) {
            const int call = 4 * epoch + m;
            assert_int_equal(run.script.count[call], sizes[m]);
            for (int i = 0; i < run.script.count[call]; i++) {
                seen[run.script.samples[call][i]]++;
                epochs[epoch][k++] = run.script.samples[call][i];
            }
        }
        for (int i = 0; i < SAMPLES; i++) { /* the last one's next is the first, at place 4 */
            const int bad = i == 3 || i == SAMPLES - 1, next = i == 3 + ENVS || i == 4;
            assert_int_equal(seen[i], bad ? 0 : next ? 2 : 1);
        }
    }
    for (int k = 0; k < SAMPLES; k++) {
        same += epochs[0][k] == epochs[1][k];
    }
    assert_true(same < 15);        /* 30 / 6 of them by chance */
    for (int a = 0; a < 12; a++) { /* each minibatch draws its own latents */
        for (int c = 0; c < a; c++) {
            assert_true(run.script.key[a] != run.script.key[c]);
        }
    }
    run_close(&run);
}

/* A stratum without any usable sample stops the steps of its update. */
TEST(nothing_usable_takes_no_step) {
    Run run;
    run_open(&run, plain_def(), NULL);
    PpoBatch *b = ppo_batch(run.ppo);
    for (int t = 0; t < STEPS; t++) {
        b->valid[t * ENVS + 2] = 0;
    }
    assert_int_equal(update(&run).skipped, 1);
    assert_int_equal(run.script.calls, 0);
    b->valid[2] = 1;
    assert_int_equal(update(&run).skipped, 0);
    assert_int_equal(run.script.calls, 1);
    run_close(&run);
}

/* ---- after the minibatches ---- */

/* The noise's floor holds after every step, its ceiling after the update; the anneal moves the
 * ceiling geometrically. */
TEST(noise_stays_within_its_bounds) {
    PpoDef def = plain_def();
    def.anneal[0] = 10, def.anneal[1] = 20;
    def.std_min = 0.2;
    def.std_max[0] = 0.8;
    def.std_max[1] = 0.2;
    static const struct {
        int iteration;
        double start, end;
    } at[] = {{0, 5.0, 0.8}, {10, 5.0, 0.8}, {15, 5.0, 0.4}, {20, 5.0, 0.2},
              {0, 0.1, 0.2}, {0, 0.5, 0.5},  {15, 0.3, 0.3}};
    for (size_t i = 0; i < sizeof at / sizeof *at; i++) {
        Run run;
        run_open(&run, def, NULL);
        run.ppo->iteration = at[i].iteration;
        run.script.gradient = 0.0f;
        float *log_std = run.policy->parameters + run.policy->network.log_std;
        const float below = log_std[-1];
        log_std[0] = log_std[1] = logf((float)at[i].start);
        PpoReport report = update(&run);
        assert_close("std", (double)expf(log_std[0]), at[i].end, 1e-6);
        assert_close("std", (double)expf(log_std[1]), at[i].end, 1e-6);
        assert_close("reported", report.action_std, at[i].end, 1e-6);
        assert_true(log_std[-1] == below); /* the critic's last bias is no noise */
        run_close(&run);
    }
}

/* The running mean starts at the policy, forgets by (1 + n)/(10 + n) while young and by the def's
 * decay later. */
TEST(average_of_the_weights) {
    PpoDef def = plain_def();
    def.average = 0.9;
    static const struct {
        int iteration;
        double kept;
    } at[] = {{0, 0.1}, {2, 0.25}, {8, 0.5}, {80, 0.9}, {1000, 0.9}};
    for (size_t i = 0; i < sizeof at / sizeof *at; i++) {
        Run run;
        run_open(&run, def, NULL);
        Policy *mean = ppo_average(run.ppo);
        assert_true(mean != run.policy);
        const size_t bytes = (size_t)policy_parameter_count(mean) * sizeof(float);
        assert_memory_equal(policy_parameters(mean), policy_parameters(run.policy), bytes);
        run.ppo->iteration = at[i].iteration;
        run.script.gradient = 0.0f;
        for (int64_t k = 0; k < policy_parameter_count(mean); k++) {
            policy_parameters(mean)[k] = 1.0f;
            policy_parameters(run.policy)[k] = 3.0f;
        }
        run.ppo->def.std_max[0] = run.ppo->def.std_max[1] = 100.0;
        update(&run);
        for (int64_t k = 0; k < policy_parameter_count(mean); k++) {
            assert_close("mean", (double)policy_parameters(mean)[k], 3.0 - 2.0 * at[i].kept, 1e-6);
            assert_true(policy_parameters(run.policy)[k] == 3.0f);
        }
        run_close(&run);
    }
    Run run;
    run_open(&run, plain_def(), NULL);
    assert_true(ppo_average(run.ppo) == run.policy);
    run_close(&run);
}

/* What the last step saw is the first of the next rollout, for every array and environment. */
TEST(the_last_observation_is_carried_over) {
    Run run;
    run_open(&run, plain_def(), NULL);
    PpoBatch *b = ppo_batch(run.ppo);
    const struct {
        float *at;
        int width;
    } areas[] = {{b->history, 15}, {b->critic, 7}, {b->target, 6}, {b->frame, 5}};
    for (size_t a = 0; a < 4; a++) {
        for (int i = 0; i < (STEPS + 1) * ENVS * areas[a].width; i++) {
            areas[a].at[i] = (float)i;
        }
    }
    update(&run);
    for (size_t a = 0; a < 4; a++) {
        const int floats = ENVS * areas[a].width;
        for (int i = 0; i < floats; i++) {
            assert_true(areas[a].at[i] == (float)(STEPS * floats + i));
        }
    }
    assert_int_equal(ppo_iteration(run.ppo), 1);
    run_close(&run);
}

/* ---- acting ---- */

/* Actions scatter around the means with the policy's deviations, which the log probability is of;
 * every time and iteration has its own noise. */
TEST(actions_scatter_around_the_mean) {
    enum { MANY = 4001 };
    MildError error = {0};
    PolicyDef policy_def = small_def();
    PpoDef def = plain_def();
    Policy *policy = policy_create(&policy_def, 1, &error);
    Pool *pool = pool_create(1);
    Ppo *ppo = ppo_create(&def, policy, pool, NULL, MANY, 17, &error);
    assert_non_null(ppo);
    float *log_std = policy->parameters + policy->network.log_std;
    log_std[0] = logf(0.5f);
    log_std[1] = logf(2.0f);
    PpoBatch *b = ppo_batch(ppo);
    Random random = random_at(3, 0, 0);
    fill_normal(b->history, 3 * MANY * 15, 1.0, &random);
    memcpy(b->history + MANY * 15, b->history, MANY * 15 * sizeof(float));
    memcpy(b->history + 2 * MANY * 15, b->history, MANY * 15 * sizeof(float));
    static float means[MANY * 2];
    policy_act(policy, NULL, MANY, b->history, means, NULL, NULL);
    ppo_act(ppo, 0);
    ppo_act(ppo, 1);
    ppo->iteration++;
    ppo_act(ppo, 2);
    for (int t = 0; t < 3; t++) {
        double sum[2] = {0}, square[2] = {0}, product[2] = {0};
        for (int e = 0; e < MANY; e++) {
            const int i = t * MANY + e, next = ((t + 1) % 3) * MANY + e;
            double log_prob = 0.0;
            for (int j = 0; j < 2; j++) {
                const double std = j ? 2.0 : 0.5;
                double noise = ((double)b->action[2 * i + j] - (double)b->mean[2 * i + j]) / std;
                double other =
                    ((double)b->action[2 * next + j] - (double)b->mean[2 * next + j]) / std;
                sum[j] += noise / MANY;
                square[j] += noise * noise / MANY;
                product[j] += noise * other / MANY;
                log_prob -= 0.5 * noise * noise + log(std) + 0.9189385332046727;
                /* products round by where their rows lie */
                expect_near("mean", (double)b->mean[2 * i + j], (double)means[2 * e + j], 1e-6);
            }
            expect_entry("log probability", i, (double)b->log_prob[i], log_prob, 1e-4);
        }
        for (int j = 0; j < 2; j++) { /* one in 10^5 lies beyond 4.4 / sqrt(4001) = 0.07 */
            assert_true(fabs(sum[j]) < 0.07 && fabs(square[j] - 1.0) < 0.1);
            assert_true(fabs(product[j]) < 0.07);
        }
    }
    ppo_destroy(ppo);
    policy_destroy(policy);
    pool_destroy(pool);
}

TEST_MAIN(NULL, NULL)
