/* A fixed team of threads that runs numbered pieces of work. Which thread runs a piece never
 * changes a result: pieces are fixed by the caller, not by the thread count. */
#ifndef MILD_POOL_H
#define MILD_POOL_H

typedef struct Pool Pool;

/* `threads` >= 1 including the caller; 0 means one per online core. NULL when out of memory or
 * threads. */
Pool *pool_create(int threads);
void pool_destroy(Pool *pool);
int pool_threads(const Pool *pool);

/* Calls work(context, piece, thread) for piece = 0 .. pieces-1, thread in [0, threads); returns
 * when all are done. Not reentrant; one caller at a time. */
void pool_run(Pool *pool, int pieces, void (*work)(void *context, int piece, int thread),
              void *context);

#endif
