/* The rows of the learner's bench, by a clock that only the learner's own calls move; its
 * multiplications, counted where they are made. */
#include "base/clock.h"
#include "bench_kit.h"
#include "learn/ppo.h"
#include "learn/product.h"

enum { ENVS = 6, STEPS = 4 };
static const double act_time = 0.125, update_time = 0.5; /* [s] of a call, exact sums */

static double now;        /* [s] of the clock */
static int acts, updates; /* calls */
static double flops;      /* of the first act and the first update of a rollout */

WRAPS(clock_seconds);
double __wrap_clock_seconds(void) {
    return now;
}

WRAPS(ppo_act);
void __wrap_ppo_act(Ppo *ppo, int t) {
    now += act_time;
    assert_int_equal(t, acts % STEPS);
    if (acts++ < STEPS) {
        __real_ppo_act(ppo, t);
    }
}

WRAPS(ppo_update);
void __wrap_ppo_update(Ppo *ppo, PpoReport *report) {
    now += update_time;
    if (updates++ == 0) {
        __real_ppo_update(ppo, report);
    }
}

WRAPS(product);
void __wrap_product(char transpose_a, char transpose_b, int m, int n, int k, const float *a,
                    int lda, const float *b, int ldb, float beta, float *c, int ldc) {
    flops += 2.0 * m * n * k;
    __real_product(transpose_a, transpose_b, m, n, k, a, lda, b, ldb, beta, c, ldc);
}

static void expect_share(const BenchReport *report, const char *name, double wanted, double part) {
    const double is = value_of(report, name);
    print_message("%-16s %12g, wanted %12g\n", name, is, wanted);
    expect_near(name, is / wanted, 1, part);
}

TEST(update_rows_are_times_by_steps) {
    static BenchReport report;
    MildError error = {0};
    ExperimentDef def = experiment_def_default();
    def.train.envs = ENVS;
    def.train.threads = 1;
    def.ppo.steps = STEPS;
    def.ppo.minibatches = 2;
    expect_good(bench_update(&def, &report, &error) == MILD_OK, &error);
    const double steps = ENVS * STEPS, both = STEPS * act_time + update_time;
    expect_share(&report, "update", 1e6 * update_time / steps, 1e-9);
    expect_share(&report, "act", 1e6 * STEPS * act_time / steps, 1e-9);
    expect_share(&report, "act_and_update", 1e6 * both / steps, 1e-9);
    expect_share(&report, "flops", flops / steps, 0.01);
    expect_share(&report, "rate", 1e-12 * flops / both, 0.01);
    assert_int_equal(report.count, 5);
    const BenchRow first = report.rows[0];
    while (report.count < 60) { /* a report takes as many as there are */
        expect_good(bench_update(&def, &report, &error) == MILD_OK, &error);
        const BenchRow *row = &report.rows[report.count - 5];
        assert_true(memcmp(row->name, first.name, sizeof first.name) == 0 && !report.is_short);
    }
    assert_true(report.rows[0].value == first.value &&
                strcmp(report.rows[0].name, first.name) == 0);
}

TEST_MAIN(NULL, NULL)
