/* Sums over the ranks in the memory of their GPUs, by NCCL. Each rank has a GPU of its own. */
#ifndef MILD_RANKS_DEVICE_H
#define MILD_RANKS_DEVICE_H

#include "device/ranks/ranks.h"

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
