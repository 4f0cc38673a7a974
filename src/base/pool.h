/* A fixed team of threads that runs numbered pieces of work. The caller fixes the pieces, so
 * neither the number of threads nor which thread runs a piece changes a result. */
#ifndef MILD_POOL_H
#define MILD_POOL_H

typedef struct Pool Pool;

/* threads: number of threads including the caller's, or 0 for one per online core. Returns NULL
 * when memory or threads run out. */
Pool *pool_create(int threads);
void pool_destroy(Pool *pool);
int pool_threads(const Pool *pool);

/* Calls work(context, piece, thread) for piece = 0 .. pieces - 1, with thread in [0, threads).
 * Returns when all pieces are done. Not reentrant; one caller at a time. */
void pool_run(Pool *pool, int pieces, void (*work)(void *context, int piece, int thread),
              void *context);

#endif
