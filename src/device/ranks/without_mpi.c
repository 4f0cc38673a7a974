/* ranks/ranks.h in a build without MPI: a process is always alone. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "device/ranks/ranks_private.h"

MildStatus ranks_open(Ranks **ranks, MildError *error) {
    int count;
    *ranks = NULL;
    if (ranks_launched(&count) && count != 1) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "started by MPI, but built without it; configure with -DMILD_MPI=ON, or "
                         "start one process");
    }
    return MILD_OK;
}

void ranks_close(Ranks *ranks) {
    (void)ranks;
}

void ranks_sum(Ranks *ranks, float *x, int64_t count) {
    (void)ranks, (void)x, (void)count;
}

void ranks_sum_double(Ranks *ranks, double *x, int64_t count) {
    (void)ranks, (void)x, (void)count;
}

void ranks_broadcast(Ranks *ranks, void *data, size_t bytes) {
    (void)ranks, (void)data, (void)bytes;
}

void ranks_gather(Ranks *ranks, const void *part, size_t bytes, void *whole) {
    (void)ranks;
    memcpy(whole, part, bytes);
}

int ranks_any(Ranks *ranks, int flag) {
    (void)ranks;
    return flag;
}

MildStatus ranks_agree(Ranks *ranks, MildStatus status, MildError *error) {
    (void)ranks, (void)error;
    return status;
}

void ranks_wait(Ranks *ranks) {
    (void)ranks;
}

void ranks_abort(const MildError *error) {
    fprintf(stderr, "mild: %s\n", error->text);
    exit(2);
}
