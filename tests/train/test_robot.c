/* Training robots other than the default: train.robot chooses, the policy remembers. */
#include <unistd.h>

#include "control/controller.h"
#include "kit.h"
#include "learn/values.h"
#include "run/train/trainer.h"

#define POLICY "build_test_robot.safetensors"
#define CHECKPOINT "build_test_robot_checkpoint.safetensors"

static ExperimentDef small_def(const char *robot) {
    ExperimentDef def = experiment_def_default();
    strcpy(def.train.robot, robot);
    def.train.envs = 8;
    def.train.threads = 2;
    def.ppo.steps = 8;
    return def;
}

static Trainer *trainer_of(const char *robot) {
    MildError error = {0};
    const ExperimentDef def = small_def(robot);
    Trainer *trainer = train_create(&def, &error);
    expect_good(trainer != NULL, &error);
    return trainer;
}

/* Two iterations of the quadruped: every loss finite, the weights moved. */
TEST(a_quadruped_trains) {
    MildError error = {0};
    Trainer *trainer = trainer_of("go1");
    assert_string_equal(policy_def(train_policy(trainer))->robot, "go1");
    assert_int_equal(policy_def(train_policy(trainer))->feet_velocity_count, 3 * 4);
    assert_int_equal(policy_def(train_policy(trainer))->estimates, 3 + 4 * 4);
    const float before = policy_parameters(train_policy(trainer))[0];
    for (int i = 0; i < 2; i++) {
        TrainReport report;
        assert_int_equal(train_iterate(trainer, &report, &error), MILD_OK);
        const double losses[] = {
            report.ppo.surrogate,        report.ppo.value_loss,         report.ppo.entropy,
            report.ppo.mirror,           report.ppo.vae_reconstruction, report.ppo.vae_kl,
            report.ppo.estimate_loss[0], report.ppo.estimate_loss[1],   report.ppo.estimate_loss[2],
            report.reward_per_step};
        for (size_t k = 0; k < sizeof losses / sizeof *losses; k++) {
            print_message("%s%.3g", k ? " " : "losses ", losses[k]);
            assert_true(isfinite(losses[k]));
        }
        print_message("\n");
        assert_true(report.ppo.value_loss > 0 && report.ppo.vae_reconstruction > 0);
        assert_true(report.ppo.skipped == 0 && report.episodes.diverged == 0);
    }
    assert_true(policy_parameters(train_policy(trainer))[0] != before);
    train_destroy(trainer);
}

/* A policy and a checkpoint of one robot are refused on another, in one line with both names. */
TEST(another_robots_policy_is_refused) {
    MildError error = {0};
    Trainer *go1 = trainer_of("go1"), *sa01 = trainer_of("sa01");
    Robot *robot[2] = {robot_open("go1", &error), robot_open("sa01", &error)};
    Controller controller = {0};
    assert_int_equal(policy_save(train_policy(go1), POLICY, "test", &error), MILD_OK);
    assert_int_equal(controller_learned(POLICY, robot[0], NULL, 1, &controller, &error), MILD_OK);
    controller_destroy(&controller);
    assert_int_equal(controller_learned(POLICY, robot[1], NULL, 1, &controller, &error),
                     MILD_ERROR_FORMAT);
    print_message("%s\n", error.text);
    assert_error(&error, MILD_ERROR_FORMAT, POLICY " go1 sa01");
    assert_null(controller.self);
    assert_int_equal(train_save(go1, CHECKPOINT, "test", &error), MILD_OK);
    assert_int_equal(train_load(go1, CHECKPOINT, &error), MILD_OK);
    assert_int_equal(train_load(sa01, CHECKPOINT, &error), MILD_ERROR_ARGUMENT);
    print_message("%s\n", error.text);
    assert_error(&error, MILD_ERROR_ARGUMENT, CHECKPOINT " robot go1 sa01");
    unlink(POLICY);
    unlink(CHECKPOINT);
    robot_destroy(robot[0]);
    robot_destroy(robot[1]);
    train_destroy(go1);
    train_destroy(sa01);
}

/* Files from before policies named their robot are those of any robot of their shape. */
TEST(a_policy_without_a_name_loads) {
    MildError error = {0};
    Robot *go1 = robot_open("go1", &error), *sa01 = robot_open("sa01", &error);
    ExperimentDef def = small_def("sa01");
    experiment_fit_robot(&def, sa01);
    def.policy.robot[0] = '\0';
    Policy *policy = policy_create(&def.policy, 1, &error);
    assert_int_equal(policy_save(policy, POLICY, "old", &error), MILD_OK);
    Controller controller = {0};
    assert_int_equal(controller_learned(POLICY, sa01, NULL, 1, &controller, &error), MILD_OK);
    controller_destroy(&controller);
    assert_int_equal(controller_learned(POLICY, go1, NULL, 1, &controller, &error),
                     MILD_ERROR_FORMAT);
    assert_error(&error, MILD_ERROR_FORMAT, POLICY " 11 estimates go1");
    unlink(POLICY);
    policy_destroy(policy);
    robot_destroy(go1);
    robot_destroy(sa01);
}

/* Where the decoder of the ground finds its 13 numbers: behind the frame, the estimates, six of
 * each foot, the push and four masses. */
TEST(the_decoder_is_that_of_the_target) {
    static const char *const names[] = {"sa01", "go1"};
    static const int first[] = {47 + 11 + 12 + 10, 47 + 19 + 24 + 10};
    MildError error = {0};
    for (int r = 0; r < 2; r++) {
        Robot *robot = robot_open(names[r], &error);
        ExperimentDef def = experiment_def_default();
        for (int target = PPO_TARGETS - 1; target >= 0; target--) {
            def.ppo.decoder_target = target;
            experiment_fit_robot(&def, robot);
            const int ground = target >= PPO_TARGET_GROUND;
            assert_int_equal(def.policy.decoder_frame, target != PPO_TARGET_GROUND);
            assert_int_equal(def.policy.ground_offset, ground ? first[r] : 0);
            assert_int_equal(def.policy.ground_count, ground ? 13 : 0);
        }
        robot_destroy(robot);
    }
}

TEST(an_unknown_robot_is_named) {
    MildError error = {0};
    const ExperimentDef def = small_def("sa02");
    assert_null(train_create(&def, &error));
    assert_error(&error, MILD_ERROR_ARGUMENT, "train.robot sa02 sa01");
}

/* The same actions, values and noise. */
static void check_all_but_decoder(Policy *a, Policy *b) {
    enum { ROWS = 3 };
    const PolicyDef *def = policy_def(a);
    const int history = def->frames * def->observation;
    static float input[ROWS * 4096], out[2][ROWS * 64];
    Policy *const of[2] = {a, b};
    assert_true(history <= 4096 && def->critic_input <= 4096 && def->actions <= 20);
    for (int i = 0; i < ROWS * 4096; i++) {
        input[i] = (float)sin(0.37 * i);
    }
    for (int k = 0; k < 2; k++) {
        policy_act(of[k], NULL, ROWS, input, out[k], NULL, NULL);
        kit_values(of[k], NULL, ROWS, input, out[k] + ROWS * 20);
        memcpy(out[k] + ROWS * 22, policy_std(of[k]), (size_t)def->actions * sizeof(float));
    }
    assert_memory_equal(out[0], out[1], sizeof out[0]);
    assert_true(policy_parameter_count(a) != policy_parameter_count(b));
}

/* train.start: the networks of a file in the place of those that the seed draws. A decoder of
 * something else is left out; those of another robot, or of another width, are refused. */
TEST(a_run_begins_with_a_policy) {
    MildError error = {0};
    ExperimentDef def = small_def("sa01");
    Trainer *first = train_create(&def, &error);
    assert_non_null(first);
    assert_int_equal(policy_save(train_policy(first), POLICY, "test", &error), MILD_OK);
    const size_t bytes = (size_t)policy_parameter_count(train_policy(first)) * sizeof(float);
    for (int given = 0; given < 2; given++) {
        def.train.seed = 2;
        strcpy(def.train.start, given ? POLICY : "");
        Trainer *second = train_create(&def, &error);
        assert_non_null(second);
        assert_int_equal(memcmp(policy_parameters(train_policy(second)),
                                policy_parameters(train_policy(first)), bytes) == 0,
                         given);
        train_destroy(second);
    }
    def.ppo.decoder_target = PPO_TARGET_GROUND; /* 13 numbers in the place of a frame's 47 */
    Trainer *second = train_create(&def, &error);
    assert_non_null(second);
    check_all_but_decoder(train_policy(second), train_policy(first));
    train_destroy(second);
    def.policy.actor_hidden[0] += 8;
    assert_null(train_create(&def, &error));
    assert_error(&error, MILD_ERROR_FORMAT, "train.start " POLICY " networks");
    train_destroy(first);
    def = small_def("go1");
    strcpy(def.train.start, POLICY);
    assert_null(train_create(&def, &error));
    print_message("%s\n", error.text);
    assert_error(&error, MILD_ERROR_FORMAT, "train.start " POLICY);
    strcpy(def.train.start, "no/such/file");
    assert_null(train_create(&def, &error));
    assert_error(&error, MILD_ERROR_IO, "train.start no/such/file");
    unlink(POLICY);
}

TEST_MAIN(NULL, NULL)
