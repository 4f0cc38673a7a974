/* In the place of the kernels in a build without CUDA. */
#include "device/device.h"
#include "ground/batch/batch.h"

const BatchKernel *const batch_kernels[] = {NULL};

MildStatus batch_gpu_reset(const MildBatch *batch, const uint8_t *which, MildStream stream,
                           MildError *error) {
    (void)which;
    (void)stream;
    return device_open(batch->device, error);
}
