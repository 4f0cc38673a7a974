/* In the place of device.cu in a build without CUDA. */
#include "batch/batch.h"
#include "device/device.h"

MildStatus batch_gpu_step(const MildBatch *batch, const MildBatchInput *input,
                          const MildBatchOutput *output, int advance, void *stream,
                          MildError *error) {
    (void)input;
    (void)output;
    (void)advance;
    (void)stream;
    return device_open(batch->device, error);
}

MildStatus batch_gpu_reset(const MildBatch *batch, const uint8_t *which, void *stream,
                           MildError *error) {
    (void)which;
    (void)stream;
    return device_open(batch->device, error);
}
