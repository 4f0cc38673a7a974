/* In the place of device.cu in a build without CUDA. */
#include "batch/batch.h"

MildStatus device_open(int device, MildError *error) {
    return mild_fail(error, MILD_ERROR_ARGUMENT,
                     "batch: device %d: built without CUDA; configure with -DMILD_CUDA=ON, or take "
                     "the cpu (in C MILD_BATCH_HOST)",
                     device);
}

void *device_alloc(int device, size_t bytes, MildError *error) {
    (void)bytes;
    device_open(device, error);
    return NULL;
}

void device_free(int device, void *memory) {
    (void)device;
    (void)memory;
}

MildStatus device_copy(int device, void *to, const void *from, size_t bytes, MildError *error) {
    (void)to;
    (void)from;
    (void)bytes;
    return device_open(device, error);
}

MildStatus device_wait(int device, MildError *error) {
    return device_open(device, error);
}

MildStatus device_step(const MildBatch *batch, const MildBatchInput *input,
                       const MildBatchOutput *output, int advance, void *stream, MildError *error) {
    (void)input;
    (void)output;
    (void)advance;
    (void)stream;
    return device_open(batch->device, error);
}

MildStatus device_reset(const MildBatch *batch, const uint8_t *which, void *stream,
                        MildError *error) {
    (void)which;
    (void)stream;
    return device_open(batch->device, error);
}

DeviceFork *device_fork_create(int device, int streams, MildError *error) {
    (void)streams;
    device_open(device, error);
    return NULL;
}

void device_fork_destroy(DeviceFork *fork) {
    (void)fork;
}

void *device_fork_stream(const DeviceFork *fork, int i) {
    (void)fork;
    (void)i;
    return NULL;
}

MildStatus device_fork(DeviceFork *fork, void *stream, MildError *error) {
    (void)fork;
    (void)stream;
    return device_open(0, error);
}

MildStatus device_join(DeviceFork *fork, void *stream, MildError *error) {
    (void)fork;
    (void)stream;
    return device_open(0, error);
}
