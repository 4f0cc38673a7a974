/* The rows of the bench of the environments, by a clock that only the environments' calls move,
 * and by what the environments said of each step. */
#include <malloc.h>

#include "base/clock.h"
#include "bench_kit.h"
#include "env/envs.h"

enum { ENVS = 3, STEPS = 20 };
static const double step_time = 3, walk_time = 5, reset_time = 100, create_time = 1000; /* [s] */

static double now;        /* [s] of the clock */
static int created;       /* calls: the first marches, the second is recorded, the third is timed */
static int ended[4];      /* episodes of each, from the flags of every step */
static int stepped[4];    /* [robots' steps] */
static double held, said; /* [B] of more robots: what the program holds, what they say */
static EnvsMemory memory; /* [B] of one robot */

WRAPS(clock_seconds);
double __wrap_clock_seconds(void) {
    return now;
}

/* [B] What this program holds. */
static size_t held_bytes(void) {
    const struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
}

WRAPS(envs_create);

/* [B] What more robots take, as they say and as the program holds more, by creating them. */
static void measure_more(const EnvsDef *def, int count, double sign) {
    EnvsDef of = *def;
    MildError error = {0};
    of.count = count;
    const size_t before = held_bytes();
    Envs *envs = __real_envs_create(&of, &error);
    expect_good(envs != NULL, &error);
    held += sign * (double)(held_bytes() - before);
    said += sign * count * (double)envs_robot_bytes(envs);
    envs_destroy(envs);
}

Envs *__wrap_envs_create(const EnvsDef *def, MildError *error) {
    now += create_time;
    assert_true(def->batch && def->count == ENVS && created < 3);
    if (created++ == 0) {
        measure_more(def, ENVS + 200, 1);
        measure_more(def, ENVS, -1);
    }
    Envs *envs = __real_envs_create(def, error);
    memory = envs_memory(envs);
    return envs;
}

WRAPS(envs_reset);
MildStatus __wrap_envs_reset(Envs *envs, const EnvsView *first, MildStream stream,
                             MildError *error) {
    now += reset_time;
    return __real_envs_reset(envs, first, stream, error);
}

WRAPS(envs_step);
MildStatus __wrap_envs_step(Envs *envs, const EnvsStep *step, MildStream stream, MildError *error) {
    const MildStatus status = __real_envs_step(envs, step, stream, error);
    now += created == 1 ? step_time : walk_time;
    for (int i = 0; i < ENVS; i++) {
        ended[created] += step->done[i];
        stepped[created]++;
    }
    return status;
}

/* The march diverges in 7 steps, it says. */
WRAPS(envs_sums);
MildStatus __wrap_envs_sums(Envs *envs, EnvsStats *sums, MildStream stream, MildError *error) {
    const MildStatus status = __real_envs_sums(envs, sums, stream, error);
    sums->diverged = created == 1 ? 7 : 0;
    return status;
}

static void expect_row(const BenchReport *report, const char *name, double wanted) {
    const double is = value_of(report, name);
    print_message("%-28s %10g, wanted %10g\n", name, is, wanted);
    expect_near(name, is, wanted, 1e-9 * fabs(wanted));
}

TEST(robots_rows_are_of_the_steps) {
    static BenchReport report;
    MildError error = {0};
    ExperimentDef def = experiment_def_default();
    def.train.envs = ENVS;
    def.train.threads = 1;
    def.task.episode = 0.16; /* so that some end within the 20 steps */
    expect_good(bench_robots(&def, &report, &error) == MILD_OK, &error);
    assert_int_equal(created, 3);
    for (int i = 1; i <= 3; i++) {
        assert_int_equal(stepped[i], ENVS * STEPS);
    }
    assert_true(ended[1] > 0 && ended[3] > 0);
    expect_row(&report, "envs", ENVS);
    expect_row(&report, "policy_steps_per_s", ENVS / step_time);
    expect_row(&report, "walking_policy_steps_per_s", ENVS / walk_time);
    expect_row(&report, "episodes_ended", ended[1]);
    expect_row(&report, "walking_episodes_ended", ended[3]);
    expect_row(&report, "diverged", 7);
    expect_row(&report, "memory_task", (double)memory.task);
    expect_row(&report, "memory_engine", (double)memory.engine);
    expect_row(&report, "memory_ground", (double)memory.ground);
    expect_row(&report, "memory_rest", (double)memory.rest);
    expect_row(&report, "memory_per_robot",
               (double)(memory.task + memory.engine + memory.ground + memory.rest));
    print_message("200 robots more hold %g B, by envs_robot_bytes %g B\n", held, said);
    if (!kit_short()) { /* a sanitizer's malloc does not say what is held */
        expect_near("memory", said, held, 0.02 * held);
    }
    assert_int_equal(report.count, 11);
}

TEST_MAIN(NULL, NULL)
