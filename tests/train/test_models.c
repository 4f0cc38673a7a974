/* Every ground model of the table is really trained on: two iterations of rollout and update each,
 * losses finite, parameters changed and finite. */
#include "kit.h"
#include "run/train/trainer.h"

enum { ITERATIONS = 2 };

/* Networks and rollout as small as they may be: the models differ in the ground only. */
static ExperimentDef small_experiment(int model) {
    ExperimentDef def = experiment_def_default();
    def.train.envs = 4;
    def.train.threads = 1;
    def.ppo.steps = 8;
    def.ppo.epochs = 1;
    def.ppo.minibatches = 2;
    int *const hidden[] = {def.policy.encoder_hidden, def.policy.decoder_hidden,
                           def.policy.actor_hidden, def.policy.critic_hidden};
    for (size_t i = 0; i < sizeof hidden / sizeof *hidden; i++) {
        memset(hidden[i], 0, POLICY_LAYERS_MAX * sizeof *hidden[i]);
        hidden[i][0] = 16;
    }
    def.task.randomize.model = model;
    def.task.randomize.rigid_share = 0; /* every robot stands on the model */
    def.task.randomize.preset_share = 0.5;
    return def;
}

static void expect_finite(const char *model, const char *what, double x) {
    if (!isfinite(x)) {
        fail_msg("%s: %s is %g", model, what, x);
    }
}

static void expect_losses(const char *model, const TrainReport *report) {
    const PpoReport *ppo = &report->ppo;
    expect_finite(model, "surrogate", ppo->surrogate);
    expect_finite(model, "value loss", ppo->value_loss);
    expect_finite(model, "KL", ppo->kl);
    expect_finite(model, "reconstruction", ppo->vae_reconstruction);
    expect_finite(model, "KL of the encoder", ppo->vae_kl);
    expect_finite(model, "mirror loss", ppo->mirror);
    for (int i = 0; i < 3; i++) {
        expect_finite(model, "regression", ppo->estimate_loss[i]);
        assert_true(ppo->estimate_loss[i] > 0);
    }
    assert_true(ppo->value_loss > 0 && ppo->vae_reconstruction > 0 && ppo->gradient_norm > 0);
    expect_finite(model, "reward", report->reward_per_step);
    assert_int_equal(ppo->skipped, 0);
    assert_int_equal(report->episodes.diverged, 0);
    assert_true(report->reward_per_step > 0);
}

/* Largest change of a parameter. */
static double change(const float *before, const float *after, int64_t count) {
    double largest = 0;
    for (int64_t i = 0; i < count; i++) {
        assert_true(isfinite(after[i]));
        largest = fmax(largest, fabs((double)after[i] - (double)before[i]));
    }
    return largest;
}

/* Trains on one model; returns the mean reward of a step of the last iteration. */
static double train_on(int model) {
    const char *name = mild_model_names[model];
    MildError error = {0};
    ExperimentDef def = small_experiment(model);
    assert_int_equal(experiment_check(&def, &error), MILD_OK);
    Trainer *trainer = train_create(&def, &error);
    if (!trainer) {
        fail_msg("%s: %s", name, error.text);
    }
    Policy *policy = train_policy(trainer);
    int64_t count = policy_parameter_count(policy);
    float *before = malloc((size_t)count * sizeof *before);
    assert_non_null(before);
    TrainReport report = {0};
    double moved[ITERATIONS];
    for (int i = 0; i < ITERATIONS; i++) {
        memcpy(before, policy_parameters(policy), (size_t)count * sizeof *before);
        assert_int_equal(train_iterate(trainer, &report, &error), MILD_OK);
        expect_losses(name, &report);
        moved[i] = change(before, policy_parameters(policy), count);
        if (!(moved[i] > 1e-7)) {
            fail_msg("%s: iteration %d moved no parameter by more than %.1g", name, i, moved[i]);
        }
        assert_int_equal(train_iteration(trainer), i + 1);
    }
    print_message("%-12s reward %.5f a step, value loss %.3g, parameters moved by %.1e and %.1e\n",
                  name, report.reward_per_step, report.ppo.value_loss, moved[0], moved[1]);
    free(before);
    train_destroy(trainer);
    return report.reward_per_step;
}

TEST(every_model_is_trained_on) {
    double reward[MILD_MODELS];
    for (int model = 0; model < MILD_MODELS; model++) {
        reward[model] = train_on(model);
        for (int other = 0; other < model; other++) { /* the ground was another one */
            assert_true(reward[other] != reward[model]);
        }
    }
}

TEST_MAIN(NULL, NULL)
