/* Every piece is run exactly once, by a thread of the team, whatever the number of threads. */
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/pool.h"
#include "kit.h"

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

TEST(test_every_piece_once) {
    const int pieces[] = {0, 1, 2, 7, PIECES};
    for (int threads = 1; threads <= 5; threads++) {
        for (size_t i = 0; i < sizeof pieces / sizeof *pieces; i++) {
            check_team(threads, pieces[i]);
        }
    }
}

/* Pieces that wait for each other: they end only when the whole team works at the same time. */
typedef struct {
    atomic_int arrived, blocked;
    int threads;
    pthread_t caller;
} Meeting;

static void wait_for_all(void *context, int piece, int thread) {
    (void)piece;
    Meeting *meeting = context;
    sigset_t mask;
    pthread_sigmask(SIG_SETMASK, NULL, &mask);
    if (pthread_equal(pthread_self(), meeting->caller)) {
        atomic_fetch_add(&meeting->blocked, thread == 0 && !sigismember(&mask, SIGINT) ? 0 : 100);
    } else {
        atomic_fetch_add(&meeting->blocked, thread > 0 && sigismember(&mask, SIGINT));
    }
    atomic_fetch_add(&meeting->arrived, 1);
    const double begin = clock_seconds();
    while (atomic_load(&meeting->arrived) < meeting->threads && clock_seconds() < begin + 20) {
        sched_yield();
    }
}

/* All threads at once; signals are the caller's alone. */
TEST(test_whole_team) {
    for (int threads = 2; threads <= 4; threads++) {
        Pool *pool = pool_create(threads);
        assert_non_null(pool);
        for (int run = 0; run < 20; run++) {
            Meeting meeting = {.threads = threads, .caller = pthread_self()};
            pool_run(pool, threads, wait_for_all, &meeting);
            assert_int_equal(atomic_load(&meeting.arrived), threads);
            assert_int_equal(atomic_load(&meeting.blocked), threads - 1);
        }
        pool_destroy(pool);
    }
}

/* The caller's piece is quick, the others are slow: when pool_run returns all are done. */
static void slow_piece(void *context, int piece, int thread) {
    int *done = context;
    const struct timespec pause = {.tv_nsec = thread > 0 ? 2000000 : 100000};
    nanosleep(&pause, NULL);
    done[piece] = 1;
}

TEST(test_waits_for_all) {
    Pool *pool = pool_create(4);
    assert_non_null(pool);
    for (int run = 0; run < 20; run++) {
        int done[6] = {0};
        pool_run(pool, 6, slow_piece, done);
        for (int i = 0; i < 6; i++) {
            assert_true(done[i]);
        }
    }
    pool_destroy(pool);
}

TEST(test_create_and_destroy) {
    for (int i = 0; i < 100; i++) {
        Pool *pool = pool_create(3);
        assert_non_null(pool);
        pool_destroy(pool);
    }
    pool_destroy(NULL);
    Pool *pool = pool_create(0);
    assert_non_null(pool);
    assert_int_equal(pool_threads(pool), sysconf(_SC_NPROCESSORS_ONLN));
    pool_destroy(pool);
}

/* The wall clock counts a pause in seconds, a thread's processor time does not. */
TEST(test_clocks) {
    const struct timespec pause = {.tv_nsec = 50000000};
    const double wall = clock_seconds(), busy = clock_thread_seconds();
    nanosleep(&pause, NULL);
    const double wall_taken = clock_seconds() - wall, busy_taken = clock_thread_seconds() - busy;
    printf("pause of 50 ms: %.1f ms of wall time, %.2f ms of processor time\n", 1e3 * wall_taken,
           1e3 * busy_taken);
    assert_true(wall_taken >= 0.05 && wall_taken < 20);
    assert_true(busy_taken >= 0 && busy_taken < 0.04);
    volatile double sum = 0;
    for (int i = 0; i < 2000000; i++) {
        sum = sum + i;
    }
    assert_true(clock_thread_seconds() - busy > 1e-4);
}

TEST_MAIN(NULL, NULL)
