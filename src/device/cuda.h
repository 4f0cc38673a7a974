/* For the CUDA C++ that calls the runtime. */
#ifndef MILD_DEVICE_CUDA_H
#define MILD_DEVICE_CUDA_H

#include <cuda_runtime.h>

extern "C" {
#include "mild/error.h"
}

/* Makes a device the current one, and the caller's again at the end of the scope. */
struct OnDevice {
    int before = 0;
    cudaError_t status;
    explicit OnDevice(int device) {
        cudaGetDevice(&before);
        status = cudaSetDevice(device);
    }
    ~OnDevice() {
        cudaSetDevice(before);
    }
};

/* ---- a kernel that begins before the one before it in the stream has ended ---- */

/* Bool: a device can do that. It is then launched with programmaticStreamSerializationAllowed. */
static inline int device_lets_go(int device) {
    int major = 0;
    cudaDeviceGetAttribute(&major, cudaDevAttrComputeCapabilityMajor, device);
    return major >= 9;
}

/* In the kernel before: from here on that one may begin. */
static __device__ __forceinline__ void kernel_let_go(void) {
#if __CUDA_ARCH__ >= 900
    cudaTriggerProgrammaticLaunchCompletion();
#endif
}

/* In that one: waits for the end of the one before, and sees what it has written. */
static __device__ __forceinline__ void kernel_wait(void) {
#if __CUDA_ARCH__ >= 900
    cudaGridDependencySynchronize();
#endif
}

static inline MildStatus checked(cudaError_t status, const char *what, MildError *error) {
    return status == cudaSuccess ? MILD_OK
                                 : mild_fail(error, MILD_ERROR_IO, "device: %s: %s", what,
                                             cudaGetErrorString(status));
}

#endif
