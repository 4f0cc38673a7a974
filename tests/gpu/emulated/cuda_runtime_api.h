/* A stand-in for the CUDA runtime as far as src/gpu calls it: the device's memory is memory, and
 * what is enqueued is done at once. With it the layer runs on the processor, where the tests hold
 * it against the learner; speed and what only a GPU does (races between blocks, order of streams)
 * it cannot show. */
#ifndef MILD_EMULATED_CUDA_H
#define MILD_EMULATED_CUDA_H

#include <stdlib.h>
#include <string.h>

typedef struct {
    unsigned x, y, z;
} uint3;
typedef uint3 dim3;
typedef struct EmulatedStream *cudaStream_t;
typedef enum { cudaSuccess, cudaErrorMemoryAllocation } cudaError_t;
enum { cudaMemcpyHostToDevice, cudaMemcpyDeviceToHost, cudaMemcpyDeviceToDevice };
enum { cudaStreamNonBlocking = 1, cudaHostRegisterDefault = 0 };
struct cudaDeviceProp {
    char name[256];
    size_t totalGlobalMem;
    int major, minor;
};

extern int emulated_failure; /* > 0: so many waits succeed, then one reports failure and so do all
                                after it */

static inline const char *cudaGetErrorString(cudaError_t code) {
    return code ? "out of memory" : "no error";
}
static inline cudaError_t cudaGetLastError(void) {
    return cudaSuccess;
}
static inline cudaError_t cudaGetDeviceCount(int *count) {
    *count = 1;
    return cudaSuccess;
}
static inline cudaError_t cudaGetDeviceProperties(struct cudaDeviceProp *properties, int device) {
    (void)device;
    memset(properties, 0, sizeof *properties);
    memcpy(properties->name, "emulated on the processor", 26);
    return cudaSuccess;
}
static inline cudaError_t cudaMalloc(void **memory, size_t bytes) {
    *memory = malloc(bytes);
    if (*memory) {
        memset(*memory, 0xff, bytes); /* NaN: what nobody wrote shows */
    }
    return *memory ? cudaSuccess : cudaErrorMemoryAllocation;
}
static inline cudaError_t cudaFree(void *memory) {
    free(memory);
    return cudaSuccess;
}
static inline cudaError_t cudaHostRegister(void *memory, size_t bytes, unsigned flags) {
    (void)memory, (void)bytes, (void)flags;
    return cudaSuccess;
}
static inline cudaError_t cudaHostUnregister(void *memory) {
    (void)memory;
    return cudaSuccess;
}
static inline cudaError_t cudaStreamCreateWithFlags(cudaStream_t *stream, unsigned flags) {
    (void)flags;
    *stream = NULL;
    return cudaSuccess;
}
static inline cudaError_t cudaStreamDestroy(cudaStream_t stream) {
    (void)stream;
    return cudaSuccess;
}
static inline cudaError_t cudaStreamSynchronize(cudaStream_t stream) {
    (void)stream;
    if (emulated_failure > 1) {
        emulated_failure--;
    }
    return emulated_failure == 1 ? cudaErrorMemoryAllocation : cudaSuccess;
}
static inline cudaError_t cudaMemcpyAsync(void *to, const void *from, size_t bytes, int kind,
                                          cudaStream_t stream) {
    (void)kind, (void)stream;
    memcpy(to, from, bytes);
    return cudaSuccess;
}
static inline cudaError_t cudaMemsetAsync(void *to, int value, size_t bytes, cudaStream_t stream) {
    (void)stream;
    memset(to, value, bytes);
    return cudaSuccess;
}

#endif
