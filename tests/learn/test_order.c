/* The order of the samples: permutations, their statistics, and the cuts of the minibatches. */
#include "check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "learn/order.h"

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
