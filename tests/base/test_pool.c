/* Every piece is run exactly once, by a thread of the team, whatever the number of threads. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "base/clock.h"
#include "base/pool.h"

#define PIECES 1000

typedef struct {
    int count[PIECES];
    int thread[PIECES];
    long sum[PIECES];
} Tally;

static void tally_piece(void *context, int piece, int thread) {
    Tally *tally = context;
    tally->count[piece]++;
    tally->thread[piece] = thread;
    long sum = 0;
    for (int i = 0; i <= piece; i++) {
        sum += i;
    }
    tally->sum[piece] = sum;
}

static void check_team(int threads, int pieces) {
    Pool *pool = pool_create(threads);
    assert_non_null(pool);
    assert_int_equal(pool_threads(pool), threads);
    Tally *tally = calloc(1, sizeof *tally);
    assert_non_null(tally);
    const int runs = 200;
    for (int run = 0; run < runs; run++) {
        pool_run(pool, pieces, tally_piece, tally);
    }
    for (int p = 0; p < PIECES; p++) {
        assert_int_equal(tally->count[p], p < pieces ? runs : 0);
        assert_in_range(tally->thread[p], 0, threads - 1);
        assert_int_equal(tally->sum[p], p < pieces ? (long)p * (p + 1) / 2 : 0);
    }
    free(tally);
    pool_destroy(pool);
}

static void test_every_piece_once(void **state) {
    (void)state;
    const int pieces[] = {0, 1, 2, 7, PIECES};
    for (int threads = 1; threads <= 5; threads++) {
        for (size_t i = 0; i < sizeof pieces / sizeof *pieces; i++) {
            check_team(threads, pieces[i]);
        }
    }
}

static void test_create_and_destroy(void **state) {
    (void)state;
    for (int i = 0; i < 100; i++) {
        Pool *pool = pool_create(3);
        assert_non_null(pool);
        pool_destroy(pool);
    }
    pool_destroy(NULL);
    Pool *pool = pool_create(0);
    assert_non_null(pool);
    assert_true(pool_threads(pool) >= 1);
    pool_destroy(pool);
}

static void test_clock_moves_forward(void **state) {
    (void)state;
    double last = clock_seconds();
    for (int i = 0; i < 1000; i++) {
        double now = clock_seconds();
        assert_true(now >= last);
        last = now;
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_piece_once),
        cmocka_unit_test(test_create_and_destroy),
        cmocka_unit_test(test_clock_moves_forward),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
