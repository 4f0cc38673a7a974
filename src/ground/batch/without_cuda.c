/* In the place of the kernels in a build without CUDA. */
#include "device/device.h"
#include "ground/batch/bodies_batch.h"

const BatchKernel *const batch_kernels[] = {NULL};

MildStatus batch_gpu_reset(const MildBatch *batch, const uint8_t *which, MildStream stream,
                           MildError *error) {
    (void)which;
    (void)stream;
    return device_open(batch->device, error);
}

MildStatus gpu_bodies_begin(const struct BodiesCall *call, int device, MildStream stream,
                            MildError *error) {
    (void)call;
    (void)stream;
    return device_open(device, error);
}

MildStatus gpu_bodies_end(const struct BodiesCall *call, int device, MildStream stream,
                          MildError *error) {
    (void)call;
    (void)stream;
    return device_open(device, error);
}
