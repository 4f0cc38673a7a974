/* In the place of gpu.cu in a build without CUDA. */
#include "device/device.h"
#include "device/gpu.h"

MildStatus gpu_open(int device, MildError *error) {
    return mild_fail(error, MILD_ERROR_ARGUMENT,
                     "device %d: " GPU_MISSING ", or take the cpu (in C MILD_BATCH_HOST)", device);
}

void *gpu_alloc(int device, size_t bytes, MildError *error) {
    (void)bytes;
    gpu_open(device, error);
    return NULL;
}

void gpu_free(int device, void *memory) {
    (void)device;
    (void)memory;
}

MildStatus gpu_copy(int device, void *to, const void *from, size_t bytes, MildError *error) {
    (void)to;
    (void)from;
    (void)bytes;
    return gpu_open(device, error);
}

MildStatus gpu_wait(int device, MildError *error) {
    return gpu_open(device, error);
}

DeviceFork *device_fork_create(int device, int streams, MildError *error) {
    (void)streams;
    gpu_open(device, error);
    return NULL;
}

void device_fork_destroy(DeviceFork *fork) {
    (void)fork;
}

MildStream device_fork_stream(const DeviceFork *fork, int i) {
    (void)fork;
    (void)i;
    return NULL;
}

MildStatus device_fork(DeviceFork *fork, MildStream stream, MildError *error) {
    (void)fork;
    (void)stream;
    return gpu_open(0, error);
}

MildStatus device_join(DeviceFork *fork, MildStream stream, MildError *error) {
    (void)fork;
    (void)stream;
    return gpu_open(0, error);
}
