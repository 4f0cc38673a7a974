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

static inline MildStatus checked(cudaError_t status, const char *what, MildError *error) {
    return status == cudaSuccess ? MILD_OK
                                 : mild_fail(error, MILD_ERROR_IO, "device: %s: %s", what,
                                             cudaGetErrorString(status));
}

#endif
