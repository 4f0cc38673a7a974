/* Memory and streams of a GPU. */
#include <stdlib.h>

extern "C" {
#include "device/device.h"
#include "device/gpu.h"
}

#include "device/cuda.h"

extern "C" MildStatus gpu_open(int device, MildError *error) {
    int count = 0;
    const cudaError_t status = cudaGetDeviceCount(&count);
    if (status != cudaSuccess || device >= count) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "device %d is not there (%d found, %s); use MILD_BATCH_HOST for "
                         "the CPU",
                         device, count, cudaGetErrorString(status));
    }
    OnDevice on(device);
    return checked(on.status, "device", error);
}

extern "C" void *gpu_alloc(int device, size_t bytes, MildError *error) {
    void *memory = NULL;
    size_t free_bytes = 0, all = 0;
    OnDevice on(device);
    cudaMemGetInfo(&free_bytes, &all);
    if (cudaMalloc(&memory, bytes) != cudaSuccess) {
        cudaGetLastError(); /* it is reported here */
        mild_fail(error, MILD_ERROR_MEMORY,
                  "out of memory on device %d: %zu MiB are needed, %zu MiB are free; take "
                  "fewer robots",
                  device, bytes >> 20, free_bytes >> 20);
        return NULL;
    }
    if (checked(cudaMemset(memory, 0, bytes), "memory", error) != MILD_OK) {
        cudaFree(memory);
        return NULL;
    }
    return memory;
}

extern "C" void gpu_free(int device, void *memory) {
    if (memory) {
        OnDevice on(device);
        cudaFree(memory);
    }
}

extern "C" MildStatus gpu_copy(int device, void *to, const void *from, size_t bytes,
                               MildError *error) {
    OnDevice on(device);
    return checked(cudaMemcpy(to, from, bytes, cudaMemcpyDefault), "copy", error);
}

/* ---- streams ---- */

struct DeviceFork {
    int device;
    int streams;
    cudaStream_t *stream; /* [streams] */
    cudaEvent_t *joined;  /* [streams] */
    cudaEvent_t forked;
};

extern "C" void device_fork_destroy(DeviceFork *fork) {
    if (!fork) {
        return;
    }
    OnDevice on(fork->device);
    for (int i = 0; i < fork->streams; i++) {
        cudaStreamDestroy(fork->stream[i]);
        cudaEventDestroy(fork->joined[i]);
    }
    cudaEventDestroy(fork->forked);
    free(fork->stream);
    free(fork->joined);
    free(fork);
}

extern "C" DeviceFork *device_fork_create(int device, int streams, MildError *error) {
    DeviceFork *fork = (DeviceFork *)calloc(1, sizeof *fork);
    OnDevice on(device);
    cudaError_t status = cudaErrorMemoryAllocation;
    if (fork) {
        fork->device = device;
        fork->stream = (cudaStream_t *)calloc((size_t)streams, sizeof *fork->stream);
        fork->joined = (cudaEvent_t *)calloc((size_t)streams, sizeof *fork->joined);
        status = fork->stream && fork->joined
                     ? cudaEventCreateWithFlags(&fork->forked, cudaEventDisableTiming)
                     : status;
    }
    for (int i = 0; status == cudaSuccess && i < streams; i++) {
        status = cudaStreamCreateWithFlags(&fork->stream[i], cudaStreamNonBlocking);
        if (status == cudaSuccess) {
            status = cudaEventCreateWithFlags(&fork->joined[i], cudaEventDisableTiming);
        }
        fork->streams = i + 1;
    }
    if (checked(status, "streams", error) != MILD_OK) {
        device_fork_destroy(fork);
        return NULL;
    }
    return fork;
}

extern "C" MildStream device_fork_stream(const DeviceFork *fork, int i) {
    return fork->stream[i];
}

extern "C" MildStatus device_fork(DeviceFork *fork, MildStream stream, MildError *error) {
    OnDevice on(fork->device);
    cudaError_t status = cudaEventRecord(fork->forked, stream);
    for (int i = 0; status == cudaSuccess && i < fork->streams; i++) {
        status = cudaStreamWaitEvent(fork->stream[i], fork->forked, 0);
    }
    return checked(status, "streams", error);
}

extern "C" MildStatus device_join(DeviceFork *fork, MildStream stream, MildError *error) {
    OnDevice on(fork->device);
    cudaError_t status = cudaSuccess;
    for (int i = 0; status == cudaSuccess && i < fork->streams; i++) {
        status = cudaEventRecord(fork->joined[i], fork->stream[i]);
        if (status == cudaSuccess) {
            status = cudaStreamWaitEvent(stream, fork->joined[i], 0);
        }
    }
    return checked(status, "streams", error);
}

extern "C" MildStatus gpu_wait(int device, MildError *error) {
    OnDevice on(device);
    return checked(cudaDeviceSynchronize(), "wait", error);
}
