/* The learned controller: it is the policy's file, acting on what each environment remembers. */
#include <unistd.h>

#include "base/random.h"
#include "control/learned.h"
#include "learn/policy.h"
#include "learn/policy_private.h"

enum { ENVS = 7 };

#include "control_kit.h"

#define PATH "build_test_controller.safetensors"

/* A policy of the task's shape with weights everywhere, its layers small. */
static PolicyDef task_policy_def(void) {
    PolicyDef def = policy_def_default();
    def.observation = SA01_OBSERVATION;
    def.frames = TASK_FRAMES;
    def.actions = SA01_JOINTS;
    def.estimates = SA01_ESTIMATES;
    def.critic_input = SA01_CRITIC;
    for (int i = 0; i < POLICY_LAYERS_MAX; i++) {
        def.encoder_hidden[i] = def.decoder_hidden[i] = i ? 0 : 16;
        def.actor_hidden[i] = def.critic_hidden[i] = i ? 0 : 16;
    }
    return def;
}

static Policy *save_policy(const PolicyDef *def) {
    MildError error = {0};
    Policy *policy = policy_create(def, 3, &error);
    assert_non_null(policy);
    Random random = random_at(1, 2, 3);
    for (int64_t i = 0; i < policy_parameter_count(policy); i++) {
        policy_parameters(policy)[i] += (float)(0.05 * random_normal(&random));
    }
    assert_int_equal(policy_save(policy, PATH, "test", &error), MILD_OK);
    return policy;
}

static void fill_histories(TaskEnv **envs, uint32_t draw) {
    for (int e = 0; e < ENVS; e++) {
        Random random = random_at(4, (uint32_t)e, draw);
        for (int i = 0; i < SA01_HISTORY; i++) {
            task_env_history(envs[e])[i] = (float)random_normal(&random);
        }
    }
}

/* From the environments, or from their histories alone. */
static void act(Controller *controller, int rows, TaskEnv *const *envs, int alone, float *actions) {
    float histories[ENVS * SA01_HISTORY];
    for (int e = 0; e < rows && alone; e++) {
        memcpy(histories + e * SA01_HISTORY, task_env_history(envs[e]),
               SA01_HISTORY * sizeof *histories);
    }
    if (alone) {
        controller->act_on(controller->self, rows, histories, actions);
    } else {
        controller->act(controller->self, rows, envs, actions);
    }
}

/* Every environment gets the mean action and the estimates of its own history, with and without
 * threads, whatever the controller was asked before: it remembers nothing, so an episode's reset
 * needs no call. */
TEST(acts_as_its_policy) {
    MildError error = {0};
    PolicyDef def = task_policy_def();
    Policy *policy = save_policy(&def);
    TaskEnv *envs[ENVS];
    for (int e = 0; e < ENVS; e++) {
        envs[e] = made[ENVS - 1 - e];
    }
    for (int threads = 0; threads <= 2; threads += 2) {
        Pool *pool = threads ? pool_create(threads) : NULL;
        Controller controller = {0};
        assert_int_equal(controller_learned(PATH, robot, pool, ENVS, &controller, &error), MILD_OK);
        assert_string_equal(controller.name, "learned");
        double worst = 0, least = 1;
        for (uint32_t draw = 0; draw < 4; draw++) {
            float actions[ENVS * SA01_JOINTS + 1], one[SA01_JOINTS], estimates[SA01_ESTIMATES];
            int rows = draw == 1 ? 2 : ENVS;
            actions[rows * SA01_JOINTS] = 42;
            fill_histories(envs, draw % 2);
            act(&controller, rows, envs, draw == 3, actions);
            assert_true(actions[rows * SA01_JOINTS] == 42);
            for (int e = 0; e < rows; e++) {
                const float *estimated = controller_estimates(&controller, e);
                policy_act(policy, NULL, 1, task_env_history(envs[e]), one, estimates, NULL);
                for (int j = 0; j < SA01_ESTIMATES; j++) {
                    worst = fmax(worst, fabs((double)estimated[j] - (double)estimates[j]));
                }
                for (int j = 0; j < SA01_JOINTS; j++) {
                    double gap = (double)actions[e * SA01_JOINTS + j] - (double)one[j];
                    worst = fmax(worst, fabs(gap));
                    least = fmin(least, fabs((double)one[j]));
                }
            }
        }
        print_message("%d threads: worst against the policy %.1e\n", threads, worst);
        assert_true(worst < 1e-5 && least > 0);
        controller_destroy(&controller);
        assert_null(controller.self);
        controller_destroy(&controller); /* nothing the second time */
        pool_destroy(pool);
    }
    policy_destroy(policy);
    unlink(PATH);
}

/* ---- parts taken out ---- */

static double worst_gap(const float *a, const float *b, int count) {
    double worst = 0;
    for (int i = 0; i < count; i++) {
        worst = fmax(worst, fabs((double)a[i] - (double)b[i]));
    }
    return worst;
}

/* The same file, but that its modulation gives `theta` whatever its input. */
static void actions_at(Policy *policy, const float *theta, const float *history, float *actions) {
    const char *name;
    const Mlp *modulation = network_mlp(&policy->network, 2, &name);
    const MlpLayer *last = &modulation->layer[modulation->layers - 1];
    const int width = policy->network.theta;
    float *p = policy->parameters;
    assert_string_equal(name, "modulation");
    for (int i = 0; i < width * policy->network.def.modulation_hidden; i++) {
        p[last->weight + i] = 0;
    }
    for (int i = 0; i < width; i++) {
        p[last->bias + i] = theta[i];
    }
    policy_act(policy, NULL, ENVS, history, actions, NULL, NULL);
}

/* Rows of a controller without a part. means: latent, estimates, theta. */
static const LearnedInside *act_without(Controller *controller, Ablation part, const float *means,
                                        float *actions) {
    MildError error = {0};
    const LearnedInside *inside;
    assert_int_equal(learned_watch(controller, &inside, &error), MILD_OK);
    learned_ablate(controller, part, means);
    controller->act(controller->self, ENVS, made, actions);
    return inside;
}

/* Row 0 gets its own numbers as the means and acts as before; the others do not. */
static void means_take_the_place(Controller *controller, Ablation part, const float *whole) {
    float means[64], actions[ENVS * SA01_JOINTS], modulated[ENVS * 64];
    const LearnedInside *inside = act_without(controller, ABLATION_none, NULL, actions);
    const size_t latent = (size_t)inside->latent, estimates = (size_t)inside->estimates;
    assert_memory_equal(actions, whole, sizeof actions);
    memcpy(means, inside->rows.latent, latent * sizeof *means);
    memcpy(means + latent, inside->rows.estimates, estimates * sizeof *means);
    memcpy(means + latent + estimates, inside->rows.theta, (size_t)inside->theta * sizeof *means);
    memcpy(modulated, inside->rows.modulated, ENVS * latent * sizeof *modulated);
    act_without(controller, part, means, actions);
    assert_memory_equal(actions, whole, SA01_JOINTS * sizeof *actions);
    for (int e = 1; e < ENVS; e++) {
        const int row = e * SA01_JOINTS;
        assert_true(worst_gap(actions + row, whole + row, SA01_JOINTS) > 1e-4);
    }
    const double changed = worst_gap(modulated, inside->rows.modulated, ENVS * inside->latent);
    assert_true(part == ABLATION_estimates ? changed == 0 : changed > 1e-2);
}

TEST(parts_are_taken_out) {
    MildError error = {0};
    PolicyDef def = task_policy_def();
    Policy *policy = save_policy(&def);
    Controller controller = {0};
    static float history[ENVS][SA01_HISTORY];
    float whole[ENVS * SA01_JOINTS], actions[ENVS * SA01_JOINTS], wanted[ENVS * SA01_JOINTS];
    assert_int_equal(controller_learned(PATH, robot, NULL, ENVS, &controller, &error), MILD_OK);
    fill_histories(made, 5);
    controller.act(controller.self, ENVS, made, whole);
    means_take_the_place(&controller, ABLATION_z, whole);
    means_take_the_place(&controller, ABLATION_estimates, whole);
    means_take_the_place(&controller, ABLATION_modulation, whole);
    for (int e = 0; e < ENVS; e++) {
        const float *newest = task_env_history(made[e]) + SA01_HISTORY - SA01_OBSERVATION;
        for (int i = 0; i < SA01_HISTORY; i++) {
            history[e][i] = newest[i % SA01_OBSERVATION];
        }
    }
    act_without(&controller, ABLATION_history, NULL, actions);
    policy_act(policy, NULL, ENVS, history[0], wanted, NULL, NULL);
    assert_true(worst_gap(actions, wanted, ENVS * SA01_JOINTS) < 1e-6);
    assert_true(worst_gap(actions, whole, ENVS * SA01_JOINTS) > 1e-3);
    float means[64] = {0};
    const LearnedInside *inside = act_without(&controller, ABLATION_none, NULL, actions);
    float *theta = means + inside->latent + inside->estimates;
    for (int i = 0; i < inside->theta; i++) {
        theta[i] = i < inside->theta / 2 ? 0.4f : -0.3f;
    }
    act_without(&controller, ABLATION_modulation, means, actions);
    for (int e = 0; e < ENVS; e++) {
        memcpy(history[e], task_env_history(made[e]), sizeof history[e]);
    }
    actions_at(policy, theta, history[0], wanted);
    assert_true(worst_gap(actions, wanted, ENVS * SA01_JOINTS) < 1e-6);
    assert_true(worst_gap(actions, whole, ENVS * SA01_JOINTS) > 1e-4);
    act_without(&controller, ABLATION_none, NULL, actions);
    assert_memory_equal(actions, whole, sizeof whole);
    controller_destroy(&controller);
    policy_destroy(policy);
    unlink(PATH);
}

/* Whose shape is not the task's is refused with both shapes named, and nothing is made. */
TEST(another_shape_is_refused) {
    static const char *const names[4] = {PATH " 46 6 sa01 47 12", PATH " 47 5 sa01 6 12",
                                         PATH " 47 6 11 sa01 12", PATH " 7 0 task.scan"};
    for (int wrong = 0; wrong < 4; wrong++) {
        MildError error = {0};
        PolicyDef def = task_policy_def();
        def.observation -= wrong == 0;
        def.frames -= wrong == 1;
        def.actions -= wrong == 2;
        def.scan = wrong == 3 ? 7 : 0;
        policy_destroy(save_policy(&def));
        Controller controller = {0};
        assert_int_equal(controller_learned(PATH, robot, NULL, 1, &controller, &error),
                         MILD_ERROR_FORMAT);
        assert_null(controller.self);
        assert_error(&error, MILD_ERROR_FORMAT, names[wrong]);
        unlink(PATH);
    }
}

TEST_MAIN(setup, teardown)
