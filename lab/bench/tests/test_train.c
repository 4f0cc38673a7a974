/* The times in the training bench and in the log of a training, by a clock that ticks once each
 * time it is read: nothing is left out and nothing counts twice. */
#include <pthread.h>

#include "base/clock.h"
#include "bench_kit.h"
#include "run/train/trainer.h"

#define TICK 0.0009765625 /* [s] 1/1024, so that sums are exact */
enum { ENVS = 6, STEPS = 4 };

static pthread_mutex_t reading = PTHREAD_MUTEX_INITIALIZER;
static double now;         /* [s] of the clock */
static double first_after; /* [s] when the first iteration was over */
static int iterations;
static TrainTimes counted; /* sums of all iterations but the first */

WRAPS(clock_seconds);
WRAPS(train_iterate);

double __wrap_clock_seconds(void) {
    pthread_mutex_lock(&reading);
    const double read = now += TICK;
    pthread_mutex_unlock(&reading);
    return read;
}

/* An iteration reads the clock first and last: its rate and its parts fill the time between. */
MildStatus __wrap_train_iterate(Trainer *trainer, TrainReport *report, MildError *error) {
    const double before = now;
    const MildStatus status = __real_train_iterate(trainer, report, error);
    const double wall = now - before - TICK;
    assert_int_equal(status, MILD_OK);
    const TrainTimes *t = &report->times;
    assert_true(fabs(ENVS * STEPS / report->steps_per_s - wall) < 1e-9);
    assert_true(fabs(t->rollout + t->update - wall) < 1e-9 && t->update >= TICK);
    assert_true(t->environments >= STEPS * TICK && t->inference >= STEPS * TICK);
    assert_true(t->environments + t->inference <= t->rollout && t->ground <= t->physics);
    if (iterations++ == 0) {
        first_after = now;
    } else {
        counted.environments += t->environments;
        counted.inference += t->inference;
        counted.update += t->update;
        counted.physics += t->physics;
        counted.ground += t->ground;
    }
    return status;
}

static void check_parts(int threads) {
    BenchReport report = {0};
    MildError error = {0};
    ExperimentDef def = experiment_def_default();
    iterations = 0;
    counted = (TrainTimes){0};
    def.train.envs = ENVS;
    def.train.threads = threads;
    def.ppo.steps = STEPS;
    def.ppo.minibatches = 2;
    assert_int_equal(bench_train(&def, &report, &error), MILD_OK);
    const double steps = (iterations - 1) * ENVS * STEPS;
    const double wall = now - first_after - TICK; /* the bench's own first and last reading */
    const double step = 1e6 / value_of(&report, "policy_steps_per_s");
    static const char *const names[] = {"physics",   "ground", "task",
                                        "inference", "update", "other"};
    double sum = 0;
    for (int i = 0; i < 6; i++) {
        const double part = value_of(&report, names[i]);
        print_message("%-10s %12.1f us of %.1f\n", names[i], part, step);
        assert_true(part >= 0);
        sum += part;
    }
    assert_true(iterations > 2);
    assert_true(fabs(step - 1e6 * wall / steps) < 1e-6 * step);
    assert_true(fabs(sum - step) < 1e-9 * step);
    assert_true(fabs(value_of(&report, "inference") - 1e6 * counted.inference / steps) <
                1e-6 * step);
    assert_true(fabs(value_of(&report, "update") - 1e6 * counted.update / steps) < 1e-6 * step);
    const double inside =
        value_of(&report, "physics") + value_of(&report, "ground") + value_of(&report, "task");
    assert_true(fabs(inside - 1e6 * counted.environments / steps) < 1e-6 * step);
    /* in physics and in the ground, its part, the threads are at once */
    assert_true(counted.ground > 0 && counted.physics > counted.ground);
    assert_true(fabs(value_of(&report, "ground") - 1e6 * counted.ground / threads / steps) <
                1e-6 * step);
    assert_true(fabs(value_of(&report, "physics") -
                     1e6 * (counted.physics - counted.ground) / threads / steps) < 1e-6 * step);
    assert_true(value_of(&report, "threads") == threads);
    bench_report_free(&report);
}

TEST(the_parts_are_the_whole) {
    check_parts(1);
    check_parts(2);
}

TEST_MAIN(NULL, NULL)
