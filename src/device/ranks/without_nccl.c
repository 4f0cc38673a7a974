/* ranks/ranks.h in a build without NCCL. */
#include "device/ranks/ranks.h"

static MildStatus refuse(const Ranks *ranks, MildError *error) {
    return ranks_count(ranks) == 1
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_ARGUMENT,
                           "train.device = cuda in %d processes: built without NCCL; configure "
                           "with -DMILD_CUDA=ON -DMILD_NCCL=ON",
                           ranks_count(ranks));
}

MildStatus ranks_open_device(Ranks *ranks, size_t bytes, MildError *error) {
    (void)bytes;
    return refuse(ranks, error);
}

MildStatus ranks_sum_device(Ranks *ranks, float *x, int64_t count, MildStream stream,
                            MildError *error) {
    (void)x, (void)count, (void)stream;
    return refuse(ranks, error);
}

MildStatus ranks_sum_device_double(Ranks *ranks, double *x, int64_t count, MildStream stream,
                                   MildError *error) {
    (void)x, (void)count, (void)stream;
    return refuse(ranks, error);
}

void ranks_close_device(Ranks *ranks) {
    (void)ranks;
}
