/* Training on every ground model, with other robots than the default, and with the batch engine,
 * here on the CPU: train.robot chooses, the policy remembers, runs repeat, and either kind of
 * robots goes on from the other's checkpoint. */
#include <sys/stat.h>
#include <unistd.h>

#include "control/controller.h"
#include "kit.h"
#include "learn/policy_private.h"
#include "run/train/trainer.h"

#define POLICY "build_test_trainer.safetensors"
#define CHECKPOINT "build_test_trainer_checkpoint.safetensors"

enum { ENVS = 8, STEPS = 8 };

static ExperimentDef small_def(const char *robot) {
    ExperimentDef def = experiment_def_default();
    strcpy(def.train.robot, robot);
    def.train.envs = ENVS;
    def.train.threads = 2;
    def.train.grounds = 32;
    def.ppo.steps = STEPS;
    return def;
}

static Trainer *create(const ExperimentDef *def) {
    MildError error = {0};
    Trainer *trainer = train_create(def, &error);
    expect_good(trainer != NULL, &error);
    return trainer;
}

static Trainer *trainer_of(const char *robot) {
    const ExperimentDef def = small_def(robot);
    return create(&def);
}

static size_t bytes_of(Trainer *trainer) {
    return (size_t)policy_parameter_count(train_policy(trainer)) * sizeof(float);
}

/* Iterations whose losses are finite and move the weights. Returns the reward of a step in the last
 * of them. */
static double iterate(Trainer *trainer, int iterations) {
    const float *weights = policy_parameters(train_policy(trainer));
    float *before = malloc(bytes_of(trainer));
    TrainReport report = {0};
    MildError error = {0};
    assert_non_null(before);
    for (int i = 0; i < iterations; i++) {
        const PpoReport *ppo = &report.ppo;
        memcpy(before, weights, bytes_of(trainer));
        expect_good(train_iterate(trainer, &report, &error) == MILD_OK, &error);
        const double losses[] = {ppo->surrogate,
                                 ppo->value_loss,
                                 ppo->entropy,
                                 ppo->kl,
                                 ppo->mirror,
                                 ppo->vae_kl,
                                 ppo->estimate_loss[0],
                                 ppo->estimate_loss[1],
                                 ppo->estimate_loss[2],
                                 ppo->gradient_norm,
                                 ppo->vae_reconstruction,
                                 report.reward_per_step};
        for (size_t k = 0; k < sizeof losses / sizeof *losses; k++) {
            print_message("%s%.3g", k ? " " : "losses ", losses[k]);
            assert_true(isfinite(losses[k]));
        }
        print_message("\n");
        assert_true(ppo->value_loss > 0 && ppo->vae_reconstruction > 0 && ppo->gradient_norm > 0);
        assert_true(ppo->skipped == 0 && report.episodes.diverged == 0);
        assert_true(report.episodes.steps == ENVS * STEPS && report.reward_per_step > 0);
        assert_true(report.episodes.assist > 0.5); /* they have just begun */
        assert_memory_not_equal(before, weights, bytes_of(trainer));
    }
    free(before);
    return report.reward_per_step;
}

TEST(every_model_is_trained_on) {
    double reward[MILD_MODELS];
    for (int model = 0; model < MILD_MODELS; model++) {
        ExperimentDef def = small_def("sa01");
        def.task.randomize.model = model;
        def.task.randomize.rigid_share = 0; /* every robot stands on the model */
        Trainer *trainer = create(&def);
        reward[model] = iterate(trainer, 2);
        assert_int_equal(train_iteration(trainer), 2);
        for (int other = 0; other < model; other++) { /* the ground was another one */
            assert_true(reward[other] != reward[model]);
        }
        train_destroy(trainer);
    }
}

TEST(a_quadruped_trains) {
    Trainer *trainer = trainer_of("go1");
    const PolicyDef *def = policy_def(train_policy(trainer));
    assert_string_equal(def->robot, "go1");
    assert_true(def->feet_velocity_count == 3 * 4 && def->estimates == 3 + 4 * 4);
    iterate(trainer, 2);
    train_destroy(trainer);
}

/* ---- the batch engine ---- */

static Trainer *trainer_with(TrainRobots robots) {
    ExperimentDef def = small_def("sa01");
    def.train.robots = (int)robots;
    def.task.physics_dt = 0.005;
    return create(&def);
}

static void expect_same(Trainer *a, Trainer *b) {
    assert_int_equal(train_iteration(a), train_iteration(b));
    assert_memory_equal(policy_parameters(train_policy(a)), policy_parameters(train_policy(b)),
                        bytes_of(a));
}

TEST(runs_repeat) {
    Trainer *a = trainer_with(TRAIN_ROBOTS_BATCH), *b = trainer_with(TRAIN_ROBOTS_BATCH);
    iterate(a, 2);
    iterate(b, 2);
    expect_same(a, b);
    train_destroy(a);
    train_destroy(b);
}

TEST(checkpoints_change_robots) {
    MildError error = {0};
    const TrainRobots way[] = {TRAIN_ROBOTS_BATCH, TRAIN_ROBOTS_BATCH, TRAIN_ROBOTS_MUJOCO,
                               TRAIN_ROBOTS_BATCH};
    struct stat file;
    Trainer *before = trainer_with(way[0]);
    iterate(before, 1);
    for (int i = 1; i < 4; i++) {
        Trainer *now = trainer_with(way[i]);
        assert_int_equal(train_save(before, CHECKPOINT, "test", &error), MILD_OK);
        assert_int_equal(stat(CHECKPOINT, &file), 0);
        assert_true(file.st_size < 16 << 20);
        assert_int_equal(train_load(now, CHECKPOINT, &error), MILD_OK);
        expect_same(before, now);
        iterate(now, 1);
        assert_int_equal(train_iteration(now), 1 + i);
        train_destroy(before);
        before = now;
    }
    train_destroy(before);
    unlink(CHECKPOINT);
}

/* ---- files ---- */

/* A policy and a checkpoint of one robot are refused on another, in one line with both names. */
TEST(another_robots_policy_is_refused) {
    MildError error = {0};
    Trainer *go1 = trainer_of("go1"), *sa01 = trainer_of("sa01");
    Robot *robot[2] = {robot_open("go1", &error), robot_open("sa01", &error)};
    Controller controller = {0};
    assert_int_equal(policy_save(train_policy(go1), POLICY, "test", &error), MILD_OK);
    assert_int_equal(controller_learned(POLICY, robot[0], NULL, 1, &controller, &error), MILD_OK);
    controller_destroy(&controller);
    assert_refused(controller_learned(POLICY, robot[1], NULL, 1, &controller, &error),
                   MILD_ERROR_FORMAT, &error, POLICY " go1 sa01");
    assert_null(controller.self);
    assert_int_equal(train_save(go1, CHECKPOINT, "test", &error), MILD_OK);
    assert_int_equal(train_load(go1, CHECKPOINT, &error), MILD_OK);
    assert_refused(train_load(sa01, CHECKPOINT, &error), MILD_ERROR_ARGUMENT, &error,
                   CHECKPOINT " robot go1 sa01");
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
    assert_refused(controller_learned(POLICY, go1, NULL, 1, &controller, &error), MILD_ERROR_FORMAT,
                   &error, POLICY " 11 estimates go1");
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

/* The same actions, values and noise. */
static void check_all_but_decoder(Policy *a, Policy *b) {
    enum { ROWS = 3 };
    const PolicyDef *def = policy_def(a);
    const int history = def->frames * def->observation;
    static float input[ROWS * 4096], out[2][ROWS * 64];
    Policy *const of[2] = {a, b};
    const PolicyRows all = {.blocks = 1, .runs = 1, .cut = {0, ROWS}};
    assert_true(history <= 4096 && def->critic_input <= 4096 && def->actions <= 20);
    for (int i = 0; i < ROWS * 4096; i++) {
        input[i] = (float)sin(0.37 * i);
    }
    for (int k = 0; k < 2; k++) {
        policy_act(of[k], NULL, ROWS, input, out[k], NULL, NULL);
        policy_value_rows(of[k], NULL, &all, input, out[k] + ROWS * 20);
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
    Trainer *first = create(&def);
    const size_t bytes = bytes_of(first);
    assert_int_equal(policy_save(train_policy(first), POLICY, "test", &error), MILD_OK);
    for (int given = 0; given < 2; given++) {
        def.train.seed = 2;
        strcpy(def.train.start, given ? POLICY : "");
        Trainer *second = create(&def);
        assert_int_equal(memcmp(policy_parameters(train_policy(second)),
                                policy_parameters(train_policy(first)), bytes) == 0,
                         given);
        train_destroy(second);
    }
    def.ppo.decoder_target = PPO_TARGET_GROUND; /* 13 numbers in the place of a frame's 47 */
    Trainer *second = create(&def);
    check_all_but_decoder(train_policy(second), train_policy(first));
    train_destroy(second);
    def.policy.actor_hidden[0] += 8;
    assert_null(train_create(&def, &error));
    assert_error(&error, MILD_ERROR_FORMAT, "train.start " POLICY " networks");
    train_destroy(first);
    def = small_def("go1");
    strcpy(def.train.start, POLICY);
    assert_null(train_create(&def, &error));
    assert_error(&error, MILD_ERROR_FORMAT, "train.start " POLICY);
    strcpy(def.train.start, "no/such/file");
    assert_null(train_create(&def, &error));
    assert_error(&error, MILD_ERROR_IO, "train.start no/such/file");
    def = small_def("sa02");
    assert_null(train_create(&def, &error));
    assert_error(&error, MILD_ERROR_ARGUMENT, "train.robot sa02 sa01");
    unlink(POLICY);
}

TEST_MAIN(NULL, NULL)
