#include "base/pool.h"

#include <assert.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <unistd.h>

#define POOL_THREADS_MAX 1024

typedef struct {
    Pool *pool;
    int thread;
    pthread_t handle;
} PoolWorker;

struct Pool {
    int threads; /* caller included */
    pthread_mutex_t mutex;
    pthread_cond_t start, done;
    unsigned run; /* number of the run now open; under mutex */
    int open;     /* bool: workers may still join this run; under mutex */
    int active;   /* workers inside the run; under mutex */
    int stop;     /* bool; under mutex */
    int pieces;
    void (*work)(void *context, int piece, int thread);
    void *context;
    atomic_int next; /* first piece that nobody has taken */
    PoolWorker worker[];
};

static void pool_drain(Pool *pool, int thread) {
    for (;;) {
        int piece = atomic_fetch_add_explicit(&pool->next, 1, memory_order_relaxed);
        if (piece >= pool->pieces) {
            return;
        }
        pool->work(pool->context, piece, thread);
    }
}

/* A worker that wakes after the run has closed goes back to sleep. So a run waits only for the
 * workers that took part. */
static void *pool_worker(void *argument) {
    PoolWorker *worker = argument;
    Pool *pool = worker->pool;
    unsigned seen = 0;
    pthread_mutex_lock(&pool->mutex);
    while (!pool->stop) {
        if (pool->run == seen) {
            pthread_cond_wait(&pool->start, &pool->mutex);
            continue;
        }
        seen = pool->run;
        if (!pool->open) {
            continue;
        }
        pool->active++;
        pthread_mutex_unlock(&pool->mutex);
        pool_drain(pool, worker->thread);
        pthread_mutex_lock(&pool->mutex);
        if (--pool->active == 0) {
            pthread_cond_signal(&pool->done);
        }
    }
    pthread_mutex_unlock(&pool->mutex);
    return NULL;
}

/* Workers start with all signals blocked, so the caller's threads handle them. */
static int pool_start(Pool *pool, int threads) {
    sigset_t all, old;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &old);
    int ok = 1;
    for (int t = 1; ok && t < threads; t++) {
        PoolWorker *worker = &pool->worker[t - 1];
        worker->pool = pool;
        worker->thread = t;
        ok = pthread_create(&worker->handle, NULL, pool_worker, worker) == 0;
        pool->threads += ok;
    }
    pthread_sigmask(SIG_SETMASK, &old, NULL);
    return ok;
}

Pool *pool_create(int threads) {
    assert(threads >= 0);
    if (threads == 0) {
        long online = sysconf(_SC_NPROCESSORS_ONLN);
        threads = online < 1 ? 1 : online > POOL_THREADS_MAX ? POOL_THREADS_MAX : (int)online;
    }
    Pool *pool = calloc(1, sizeof *pool + (size_t)(threads - 1) * sizeof(PoolWorker));
    if (!pool) {
        return NULL;
    }
    pool->threads = 1;
    pthread_mutex_init(&pool->mutex, NULL);
    pthread_cond_init(&pool->start, NULL);
    pthread_cond_init(&pool->done, NULL);
    if (!pool_start(pool, threads)) {
        pool_destroy(pool);
        return NULL;
    }
    return pool;
}

void pool_destroy(Pool *pool) {
    if (!pool) {
        return;
    }
    pthread_mutex_lock(&pool->mutex);
    pool->stop = 1;
    pthread_cond_broadcast(&pool->start);
    pthread_mutex_unlock(&pool->mutex);
    for (int t = 1; t < pool->threads; t++) {
        pthread_join(pool->worker[t - 1].handle, NULL);
    }
    pthread_cond_destroy(&pool->done);
    pthread_cond_destroy(&pool->start);
    pthread_mutex_destroy(&pool->mutex);
    free(pool);
}

int pool_threads(const Pool *pool) {
    return pool->threads;
}

void pool_run(Pool *pool, int pieces, void (*work)(void *context, int piece, int thread),
              void *context) {
    pool->pieces = pieces;
    pool->work = work;
    pool->context = context;
    atomic_store_explicit(&pool->next, 0, memory_order_relaxed);
    if (pool->threads == 1 || pieces <= 1) {
        pool_drain(pool, 0);
        return;
    }
    pthread_mutex_lock(&pool->mutex);
    pool->run++;
    pool->open = 1;
    pthread_cond_broadcast(&pool->start);
    pthread_mutex_unlock(&pool->mutex);
    pool_drain(pool, 0);
    pthread_mutex_lock(&pool->mutex);
    pool->open = 0;
    while (pool->active > 0) {
        pthread_cond_wait(&pool->done, &pool->mutex);
    }
    pthread_mutex_unlock(&pool->mutex);
}
