/* Training with the batch engine, here on the CPU: runs repeat, and either kind of robots goes on
 * from the other's checkpoint. */
#include <sys/stat.h>
#include <unistd.h>

#include "kit.h"
#include "run/train/trainer.h"

#define CHECKPOINT "build_test_batch_checkpoint.safetensors"

enum { ENVS = 16, ITERATIONS = 2 };

/* 5 ms physics; patches, as the defaults have them. */
static Trainer *trainer_of(TrainRobots robots) {
    MildError error = {0};
    ExperimentDef def = experiment_def_default();
    def.train.envs = ENVS;
    def.train.threads = 2;
    def.train.grounds = 32;
    def.train.robots = (int)robots;
    def.ppo.steps = 8;
    def.task.physics_dt = 0.005;
    Trainer *trainer = train_create(&def, &error);
    expect_good(trainer != NULL, &error);
    return trainer;
}

static void iterate(Trainer *trainer, int iterations) {
    MildError error = {0};
    for (int i = 0; i < iterations; i++) {
        TrainReport report;
        assert_int_equal(train_iterate(trainer, &report, &error), MILD_OK);
        assert_true(report.ppo.skipped == 0 && report.episodes.diverged == 0);
        assert_true(report.episodes.steps == ENVS * 8 && report.reward_per_step > 0);
        assert_true(report.episodes.assist > 0.5); /* they have just begun */
    }
}

static const float *weights(Trainer *trainer, size_t *bytes) {
    Policy *policy = train_policy(trainer);
    *bytes = (size_t)policy_parameter_count(policy) * sizeof(float);
    return policy_parameters(policy);
}

static void expect_same(Trainer *a, Trainer *b) {
    size_t bytes;
    assert_int_equal(train_iteration(a), train_iteration(b));
    const float *other = weights(b, &bytes);
    assert_memory_equal(weights(a, &bytes), other, bytes);
}

TEST(runs_repeat) {
    Trainer *a = trainer_of(TRAIN_ROBOTS_BATCH), *b = trainer_of(TRAIN_ROBOTS_BATCH);
    iterate(a, ITERATIONS);
    iterate(b, ITERATIONS);
    expect_same(a, b);
    train_destroy(a);
    train_destroy(b);
}

TEST(checkpoints_change_robots) {
    MildError error = {0};
    const TrainRobots way[] = {TRAIN_ROBOTS_BATCH, TRAIN_ROBOTS_BATCH, TRAIN_ROBOTS_MUJOCO,
                               TRAIN_ROBOTS_BATCH};
    struct stat file;
    Trainer *before = trainer_of(way[0]);
    iterate(before, 1);
    for (int i = 1; i < 4; i++) {
        Trainer *now = trainer_of(way[i]);
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

TEST_MAIN(NULL, NULL)
