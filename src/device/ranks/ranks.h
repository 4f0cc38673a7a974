/* Processes that train together: the ranks of MPI, started by mpirun (docs/ranks.md).
 *
 * Every rank calls these functions in the same order with the same sizes, and each call returns
 * when its result is there. NULL is a process alone, which every function allows. A rank that is
 * lost ends the program of all others: MPI's launcher sees to it. */
#ifndef MILD_RANKS_H
#define MILD_RANKS_H

#include <stddef.h>
#include <stdint.h>

#include "mild/error.h"

#define RANKS_MAX 64 /* their number is a power of two up to this */

typedef struct Ranks Ranks;

/* Joins the other ranks. *ranks is NULL in a process that no launcher of MPI has started: then MPI
 * is not initialised, which would take half a second. Call it once, before other threads run, but
 * after signals were blocked that they shall not see. */
MildStatus ranks_open(Ranks **ranks, MildError *error);
void ranks_close(Ranks *ranks);

int ranks_count(const Ranks *ranks);
int ranks_number(const Ranks *ranks); /* 0 .. count - 1; rank 0 reads, writes and speaks for all */
int ranks_local(const Ranks *ranks);  /* number among the ranks of its machine */
/* Threads for this rank: its share of the machine's cores, or as many as the launcher has bound it
 * to. 0 for a process alone. */
int ranks_threads(const Ranks *ranks);

/* Sum over all ranks into x [count] of each. The order is fixed, ((0+1)+(2+3))+((4+5)+(6+7)) for 8:
 * numbers that each rank has summed over its run of them as such a tree give the same bits for any
 * number of ranks. */
void ranks_sum(Ranks *ranks, float *x, int64_t count);
void ranks_sum_double(Ranks *ranks, double *x, int64_t count);

void ranks_broadcast(Ranks *ranks, void *data, size_t bytes); /* from rank 0 */
/* The parts of all ranks, one after the other, into `whole` on rank 0. Their sizes may differ. */
void ranks_gather(Ranks *ranks, const void *part, size_t bytes, void *whole);

int ranks_any(Ranks *ranks, int flag); /* bool: it is set on one rank or more */
/* The failure of the first rank that failed, on all of them, or MILD_OK. Every step that can fail
 * on one rank alone ends with it. */
MildStatus ranks_agree(Ranks *ranks, MildStatus status, MildError *error);
void ranks_wait(Ranks *ranks); /* for each other */
/* Says why in one line, and ends all ranks with exit code 2. For a failure in a place where the
 * others would wait for ever. */
void ranks_abort(const MildError *error);

/* ---- sums in the memory of GPUs, by NCCL: each rank has a GPU of its own ---- */

/* Makes the GPU whose number is this rank's among those of its machine the current one, and joins
 * the GPUs. bytes: largest sum. All ranks agree on the result. Does nothing in a process alone. */
MildStatus ranks_open_device(Ranks *ranks, size_t bytes, MildError *error);
/* The same sums as ranks_sum, to the last bit, of x [count] on the device. They are enqueued on the
 * stream (a cudaStream_t), may be captured in a graph, and need no copy to the host. */
MildStatus ranks_sum_device(Ranks *ranks, float *x, int64_t count, MildStream stream,
                            MildError *error);
MildStatus ranks_sum_device_double(Ranks *ranks, double *x, int64_t count, MildStream stream,
                                   MildError *error);
void ranks_close_device(Ranks *ranks); /* ranks_close calls it */

#endif
