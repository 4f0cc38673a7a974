/* A stand-in for the CUDA runtime as far as src/learn/cuda calls it: the device's memory is memory,
 * and what is enqueued is done at once. With it the layer runs on the processor, where the tests
 * hold it against the learner; speed and what only a GPU does (races between blocks, order of
 * streams) it cannot show. */
#ifndef MILD_EMULATED_CUDA_H
#define MILD_EMULATED_CUDA_H

#include <stdlib.h>
#include <string.h>

typedef struct {
    unsigned x, y, z;
} uint3;
typedef uint3 dim3;
typedef struct {
    float x, y, z, w;
} float4;
typedef struct CUstream_st *cudaStream_t;
typedef struct EmulatedGraph *cudaGraph_t;
typedef struct EmulatedGraphExec *cudaGraphExec_t;
typedef enum { cudaSuccess, cudaErrorMemoryAllocation, cudaErrorNotSupported } cudaError_t;
enum cudaMemcpyKind { cudaMemcpyHostToDevice, cudaMemcpyDeviceToHost, cudaMemcpyDeviceToDevice };
enum { cudaStreamNonBlocking = 1, cudaHostRegisterDefault = 0 };
enum { cudaStreamCaptureModeThreadLocal };
struct cudaDeviceProp {
    char name[256];
    size_t totalGlobalMem;
    int major, minor;
};

extern int emulated_failure; /* > 0: so many waits succeed, then one reports failure and so do all
                                after it */

extern size_t emulated_memory; /* [bytes] of the device */

static inline const char *cudaGetErrorString(cudaError_t code) {
    return code ? "out of memory" : "no error";
}
static inline cudaError_t cudaGetLastError(void) {
    return cudaSuccess;
}
static inline cudaError_t cudaGetDeviceCount(int *count) {
    *count = 64;
    return cudaSuccess;
}
static inline cudaError_t cudaGetDeviceProperties(struct cudaDeviceProp *properties, int device) {
    (void)device;
    memset(properties, 0, sizeof *properties);
    memcpy(properties->name, "emulated on the processor", 26);
    return cudaSuccess;
}
static inline cudaError_t cudaMalloc(void **memory, size_t bytes) {
    *memory = bytes <= emulated_memory ? malloc(bytes) : NULL;
    if (*memory) {
        memset(*memory, 0xff, bytes); /* NaN: what nobody wrote shows */
    }
    return *memory ? cudaSuccess : cudaErrorMemoryAllocation;
}
static inline cudaError_t cudaMemGetInfo(size_t *available, size_t *total) {
    *available = *total = emulated_memory;
    return cudaSuccess;
}
static inline cudaError_t cudaGetDevice(int *device) {
    *device = 0;
    return cudaSuccess;
}
static inline cudaError_t cudaSetDevice(int device) {
    (void)device;
    return cudaSuccess;
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
/* Work is done at once and leaves nothing to replay: a graph is refused. */
static inline cudaError_t cudaStreamBeginCapture(cudaStream_t stream, int mode) {
    (void)stream, (void)mode;
    return cudaErrorNotSupported;
}
static inline cudaError_t cudaStreamEndCapture(cudaStream_t stream, cudaGraph_t *graph) {
    (void)stream, (void)graph;
    return cudaErrorNotSupported;
}
static inline cudaError_t cudaGraphInstantiate(cudaGraphExec_t *exec, cudaGraph_t graph,
                                               unsigned long long flags) {
    (void)exec, (void)graph, (void)flags;
    return cudaErrorNotSupported;
}
static inline cudaError_t cudaGraphLaunch(cudaGraphExec_t exec, cudaStream_t stream) {
    (void)exec, (void)stream;
    return cudaErrorNotSupported;
}
static inline cudaError_t cudaGraphDestroy(cudaGraph_t graph) {
    (void)graph;
    return cudaSuccess;
}
static inline cudaError_t cudaGraphExecDestroy(cudaGraphExec_t exec) {
    (void)exec;
    return cudaSuccess;
}
static inline cudaError_t cudaMemcpyAsync(void *to, const void *from, size_t bytes,
                                          enum cudaMemcpyKind kind, cudaStream_t stream) {
    (void)kind, (void)stream;
    memmove(to, from, bytes);
    return cudaSuccess;
}
static inline cudaError_t cudaMemsetAsync(void *to, int value, size_t bytes, cudaStream_t stream) {
    (void)stream;
    memset(to, value, bytes);
    return cudaSuccess;
}

#endif
