/* The learner's small parts: elementwise functions, noise, advantages, Adam. */
#include "check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "learn/noise.h"
#include "learn/optimiser.h"
#include "learn/order.h"
#include "learn/ppo.h"
#include "learn/ppo_gradient.h"
#include "learn/ppo_private.h"
#include "learn/product.h"
#include "learn/vector.h"

extern int omp_get_max_threads(void); /* clang comes without omp.h */

TEST(test_elementwise_functions) {
    for (double x = -87.0; x < 88.0; x += 1e-3) {
        float at = (float)x;
        expect_near("exp", (double)vector_exp(at) / exp((double)at), 1, 4e-7);
        double elu = at > 0.0f ? (double)at : expm1((double)at);
        expect_near("elu", (double)vector_elu(at), elu, 4e-7 * fmax(1.0, fabs(elu)));
        double slope = at > 0.0f ? 1.0 : exp((double)at);
        expect_near("elu's slope", (double)vector_elu_slope(vector_elu(at)), slope, 4e-7);
    }
    for (double x = 1e-30; x < 1e30; x *= 1.001) {
        float at = (float)x;
        double exact = log((double)at);
        expect_near("log", (double)vector_log(at), exact, 3e-7 * fmax(1.0, fabs(exact)));
    }
    assert_true(vector_elu(0.0f) == 0.0f && vector_log(1.0f) == 0.0f && vector_exp(0.0f) == 1.0f);
    assert_true(isnan(vector_elu(NAN)) && isnan(vector_exp(NAN)));
    assert_true(vector_elu(-INFINITY) == -1.0f && vector_elu(1e30f) == 1e30f);
}

/* The noise's angle: sine and cosine of pi a over its whole range. */
TEST(test_half_turn) {
    for (int i = -5000; i < 5000; i++) {
        float a = (float)i / 10000.0f;
        double angle = 3.14159265358979323846 * (double)a;
        expect_near("sine", (double)noise_sin(a), sin(angle), 3e-7);
        expect_near("cosine", (double)noise_cos(a), cos(angle), 3e-7);
    }
}

/* A product that the library refuses is not a number everywhere, so that the update is dropped; and
 * within a product every thread works alone. */
TEST(test_refused_product) {
    float a[6] = {1, 2, 3, 4, 5, 6}, b[6] = {1, 0, 0, 1, 1, 1}, c[8];
    for (int i = 0; i < 8; i++) {
        c[i] = 7.0f;
    }
    product('N', 'N', 2, 2, 3, a, 3, b, 2, 0.0f, c, 3);
    static const float wanted[8] = {4, 5, 7, 10, 11, 7, 7, 7}; /* rows of 3, two of them used */
    assert_memory_equal(c, wanted, sizeof c);
    product('?', 'N', 2, 2, 3, a, 3, b, 2, 0.0f, c, 3);
    for (int i = 0; i < 8; i++) {
        assert_true(i < 5 && i != 2 ? isnan(c[i]) : c[i] == 7.0f);
    }
    const int before = omp_get_max_threads(), entered = product_enter(0);
    assert_int_equal(entered, before);
    assert_int_equal(omp_get_max_threads(), 1);
    product_leave(3);
    assert_int_equal(omp_get_max_threads(), 3);
    product_leave(before);
}

TEST(test_noise_is_normal) {
    enum { COUNT = 1 << 20 };
    float *x = malloc(COUNT * sizeof *x);
    assert_non_null(x);
    noise_normal(0x123456789abcdefu, 0, COUNT, x);
    double moment[5] = {0}, neighbours = 0.0, pairs = 0.0;
    int tail = 0;
    for (int i = 0; i < COUNT; i++) {
        double v = x[i];
        for (int k = 1; k <= 4; k++) {
            moment[k] += pow(v, k) / COUNT;
        }
        neighbours += i > 0 ? v * (double)x[i - 1] / COUNT : 0.0;
        pairs += i > 1 ? fabs(v) * fabs((double)x[i - 2]) / COUNT : 0.0;
        tail += fabs(v) > 3.0;
    }
    expect_near("mean", moment[1], 0, 5e-3);
    expect_near("variance", moment[2], 1, 7e-3);
    expect_near("third moment", moment[3], 0, 2e-2);
    expect_near("fourth moment", moment[4], 3, 5e-2);
    expect_near("neighbours", neighbours, 0, 5e-3);
    expect_near("neighbours of pairs", pairs, 2 / 3.14159265, 5e-3);
    expect_near("beyond 3 sigma", (double)tail / COUNT, 0.0027, 3e-4);
    free(x);
}

TEST(test_noise_depends_on_key_and_place_only) {
    float whole[1000], part[1000], other[1000];
    noise_normal(77, 0, 1000, whole);
    for (int first = 0; first < 1000; first += 33) { /* from either number of a pair */
        int count = 1000 - first < 33 ? 1000 - first : 33;
        noise_normal(77, first, count, part + first);
    }
    assert_memory_equal(whole, part, sizeof whole);
    noise_normal(78, 0, 1000, other);
    int same = 0;
    for (int i = 0; i < 1000; i++) {
        same += whole[i] == other[i];
    }
    assert_true(same < 3);
}

TEST(test_adam) {
    enum { COUNT = 37 };
    float p[COUNT], m[COUNT] = {0}, v[COUNT] = {0}, g[COUNT];
    double pd[COUNT], md[COUNT] = {0}, vd[COUNT] = {0};
    Random random = random_at(1, 2, 3);
    fill_normal(p, COUNT, 1.0, &random);
    for (int i = 0; i < COUNT; i++) {
        pd[i] = p[i];
    }
    for (int t = 1; t <= 50; t++) {
        fill_normal(g, COUNT, 0.1, &random);
        adam_apply(adam_step(0.01, t, 0.5), COUNT, g, p, m, v);
        for (int i = 0; i < COUNT; i++) {
            double grad = 0.5 * (double)g[i];
            md[i] = 0.9 * md[i] + 0.1 * grad;
            vd[i] = 0.999 * vd[i] + 0.001 * grad * grad;
            pd[i] -=
                0.01 * (md[i] / (1.0 - pow(0.9, t))) / (sqrt(vd[i] / (1.0 - pow(0.999, t))) + 1e-8);
            expect_entry("Adam", i, (double)p[i], pd[i], 5e-6);
        }
    }
}

#define RETURNS_STEPS 30
#define RETURNS_ENVS 5

/* Discounted sum by its definition, A_t = sum_k (gamma lambda)^k delta_t+k up to the end of the
 * episode. */
static double advantage_by_sum(const PpoDef *def, const PpoBatch *b, int t, int env) {
    double sum = 0.0, weight = 1.0;
    for (int k = t; k < RETURNS_STEPS; k++) {
        const int i = k * RETURNS_ENVS + env;
        double next = b->done[i] ? (b->timeout[i] ? (double)b->value[i] : 0.0)
                                 : (double)b->value[i + RETURNS_ENVS];
        sum += weight * ((double)b->reward[i] + def->gamma * next - (double)b->value[i]);
        weight *= def->gamma * def->lambda;
        if (b->done[i] || (k + 1 < RETURNS_STEPS && !b->valid[i + RETURNS_ENVS])) {
            break;
        }
    }
    return sum;
}

TEST(test_advantages) {
    MildError error = {0};
    PolicyDef policy_def = small_def();
    PpoDef def = ppo_def_default();
    def.steps = RETURNS_STEPS;
    Policy *policy = policy_create(&policy_def, 1, &error);
    Pool *pool = pool_create(1);
    Ppo *ppo = ppo_create(&def, policy, pool, NULL, RETURNS_ENVS, 1, &error);
    assert_non_null(ppo);
    PpoBatch *b = ppo_batch(ppo);
    Random random = random_at(9, 9, 9);
    fill_normal(b->value, (RETURNS_STEPS + 1) * RETURNS_ENVS, 1.0, &random);
    fill_normal(b->reward, RETURNS_STEPS * RETURNS_ENVS, 1.0, &random);
    for (int i = 0; i < RETURNS_STEPS * RETURNS_ENVS; i++) {
        b->done[i] = random_unit(&random) < 0.1;
        b->timeout[i] = b->done[i] && random_unit(&random) < 0.5;
        b->valid[i] = random_unit(&random) > 0.05;
        b->advantage[i] = b->returns[i] = 7.0f; /* of an earlier iteration */
    }
    PpoReport report = {0};
    ppo_returns(ppo, &report);
    double sum = 0.0, squares = 0.0, direct[RETURNS_STEPS * RETURNS_ENVS];
    int valid = 0;
    for (int i = 0; i < RETURNS_STEPS * RETURNS_ENVS; i++) {
        valid += b->valid[i];
        assert_true(b->valid[i] || (b->advantage[i] == 0.0f && b->returns[i] == 0.0f));
        if (b->valid[i]) {
            direct[i] = advantage_by_sum(&def, b, i / RETURNS_ENVS, i % RETURNS_ENVS);
            expect_near("return", (double)b->returns[i], direct[i] + (double)b->value[i], 1e-5);
            sum += direct[i];
        }
    }
    sum /= valid;
    for (int i = 0; i < RETURNS_STEPS * RETURNS_ENVS; i++) {
        squares += b->valid[i] ? pow(direct[i] - sum, 2) / valid : 0.0;
    }
    for (int i = 0; i < RETURNS_STEPS * RETURNS_ENVS; i++) {
        const double wanted = b->valid[i] ? (direct[i] - sum) / sqrt(squares) : 0.0;
        expect_near("normalised advantage", (double)b->advantage[i], wanted, 1e-5);
    }
    expect_near("deviation", report.advantage_std, sqrt(squares), 1e-5);
    ppo_destroy(ppo);
    policy_destroy(policy);
    pool_destroy(pool);
}

/* The order of the samples: permutations, their statistics, and the cuts of the minibatches. */

TEST(orders_are_permutations) {
    static char seen[5000];
    for (int count = 1; count <= 5000; count += count < 300 ? 1 : 1175) {
        const Order order = order_make(count, 7, count, 3, 5);
        memset(seen, 0, sizeof seen);
        for (int place = 0; place < count; place++) {
            const int k = order_at(&order, place);
            assert_true(k >= 0 && k < count);
            assert_int_equal(seen[k]++, 0);
        }
    }
}

/* (chi-square - degrees of freedom) / sqrt(2 degrees): about a standard normal number. */
static double excess(const double *cells, int count, double total) {
    double chi = 0.0;
    for (int i = 0; i < count; i++) {
        chi += pow(cells[i] - total / count, 2) / (total / count);
    }
    return (chi - (count - 1)) / sqrt(2.0 * (count - 1));
}

/* What two places hold, over orders of one argument that runs: all pairs are equally frequent. */
static double pairs(int count, int a, int b, int argument) {
    enum { EACH = 50, MOST = 64 };
    static double cells[MOST * MOST];
    const int total = EACH * count * (count - 1);
    memset(cells, 0, sizeof cells);
    for (int i = 0; i < total; i++) {
        const Order order =
            order_make(count, argument == 0 ? (uint64_t)i : 1, argument == 1 ? i : 1,
                       argument == 2 ? i : 1, argument == 3 ? i : 1);
        const int first = order_at(&order, a), second = order_at(&order, b);
        cells[first * (count - 1) + second - (second > first)] += 1.0;
    }
    return excess(cells, count * (count - 1), total);
}

TEST(pairs_are_uniform) {
    static const int counts[] = {3, 4, 5, 6, 8, 13, 16, 17, 31, 64};
    double worst = 0.0;
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        for (int argument = 0; argument < 4; argument++) {
            const int n = counts[i];
            worst = fmax(worst, fabs(pairs(n, 0, 1, argument)));
            worst = fmax(worst, fabs(pairs(n, 0, n - 1, argument)));
            worst = fmax(worst, fabs(pairs(n, n / 2, n / 2 - 1, argument)));
        }
    }
    /* chi-square has a longer tail than the normal */
    expect_near("chi-square of pairs of places", worst, 0, 5.0);
}

/* One order of many samples: places of 32 equal runs fill 32 equal runs of samples evenly, and
 * neighbours of places are not neighbours among the samples. */
TEST(one_order_is_mixed) {
    enum { COUNT = 49152, RUNS = 32 };
    static double cells[RUNS * RUNS], near_cells[RUNS];
    double worst = 0.0;
    for (int epoch = 0; epoch < 8; epoch++) {
        const Order order = order_make(COUNT, 1, 2, epoch, 3);
        memset(cells, 0, sizeof cells);
        memset(near_cells, 0, sizeof near_cells);
        for (int place = 0, before = 0; place < COUNT; place++) {
            const int k = order_at(&order, place);
            cells[place / (COUNT / RUNS) * RUNS + k / (COUNT / RUNS)] += 1.0;
            near_cells[(k - before + COUNT) % COUNT / (COUNT / RUNS)] += 1.0;
            before = k;
        }
        worst = fmax(worst, fabs(excess(cells, RUNS * RUNS, COUNT)));
        worst = fmax(worst, fabs(excess(near_cells, RUNS, COUNT)));
    }
    expect_near("chi-square of one order", worst, 0, 4.0);
}

/* Strata hold every sample once; the minibatches' cuts add up to them. */
TEST(strata_and_cuts_cover_everything) {
    static const int sizes[][4] = {{8, 24, 64, 4}, {8, 6, 5, 4},   {8, 1, 1, 3},   {8, 7, 37, 5},
                                   {8, 3, 8, 1},   {16, 7, 37, 5}, {64, 6, 64, 4}, {1, 3, 5, 2}};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        const int shards = sizes[i][0], steps = sizes[i][1], envs = sizes[i][2],
                  minibatches = sizes[i][3];
        char seen[24 * 64] = {0};
        int shard[PPO_SHARDS_MAX] = {0}, total = 0;
        for (int m = 0; m < minibatches; m++) {
            int cut[PPO_SHARDS_MAX + 1];
            const int count = order_cuts(shards, steps, envs, m, minibatches, cut);
            total += count;
            for (int s = 0; s < PPO_SHARDS_MAX; s++) {
                shard[s] += cut[s + 1] - cut[s];
                if (s >= shards) {
                    assert_int_equal(cut[s + 1], count);
                    continue;
                }
                /* a fair share, up to rounding */
                const double fair =
                    (double)order_stratum(shards, steps, envs, s).count / minibatches;
                assert_true(fabs(cut[s + 1] - cut[s] - fair) < 1.0);
            }
        }
        assert_int_equal(total, steps * envs);
        for (int s = 0; s < shards; s++) {
            const OrderStratum stratum = order_stratum(shards, steps, envs, s);
            assert_int_equal(shard[s], stratum.count);
            for (int k = 0; k < stratum.count; k++) {
                const int sample = order_sample(stratum, envs, k), env = sample % envs;
                assert_true(env >= envs * s / shards && env < envs * (s + 1) / shards);
                assert_int_equal(seen[sample]++, 0);
            }
        }
    }
}

/* The parts of 1, 2, 4 .. `shards` processes hold every environment once, and the strata of a part
 * name its samples by their places in its own arrays. */
static void check_parts(int shards) {
    enum { STEPS = 3, ENVS = 67 };
    for (int ranks = 1; ranks <= shards; ranks *= 2) {
        int next = 0;
        for (int rank = 0; rank < ranks; rank++) {
            const OrderPart part = order_part(shards, ENVS, rank, ranks);
            assert_int_equal(part.envs, ENVS);
            assert_int_equal(part.all, shards);
            assert_int_equal(part.first, next);
            next += part.width;
            int strata = 0;
            for (int s = 0; s < shards; s++) {
                const OrderStratum whole = order_stratum(shards, STEPS, ENVS, s),
                                   own = order_part_stratum(STEPS, part, s);
                if (s * ranks / shards != rank) {
                    assert_int_equal(own.count, 0);
                    continue;
                }
                assert_int_equal(own.count, whole.count);
                strata++;
                for (int k = 0; k < whole.count; k++) {
                    const int at = order_sample(whole, ENVS, k),
                              mine = order_sample(own, part.width, k);
                    assert_int_equal(mine / part.width, at / ENVS);
                    assert_int_equal(part.first + mine % part.width, at % ENVS);
                }
            }
            assert_int_equal(strata, part.shards);
        }
        assert_int_equal(next, ENVS);
    }
}

TEST(parts_are_whole_strata) {
    check_parts(8);
    check_parts(32);
    check_parts(PPO_SHARDS_MAX);
}

TEST_MAIN(NULL, NULL)
