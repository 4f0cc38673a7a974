/* What device.h is on a GPU: gpu.cu, or without_cuda.c. */
#ifndef MILD_DEVICE_GPU_H
#define MILD_DEVICE_GPU_H

#include <stddef.h>

#include "mild/error.h"

/* What a build without CUDA says. A wheel is not built again: another one has the kernels. */
#ifdef MILD_WHEEL
#define GPU_MISSING                                                                                \
    "this wheel has no CUDA; install the wheel mildground_cuda of the same version beside it "     \
    "(docs/install.md, GPUs)"
#else
#define GPU_MISSING "built without CUDA; configure with -DMILD_CUDA=ON (docs/gpu.md)"
#endif

MildStatus gpu_open(int device, MildError *error);
void *gpu_alloc(int device, size_t bytes, MildError *error);
void gpu_free(int device, void *memory);
MildStatus gpu_copy(int device, void *to, const void *from, size_t bytes, MildError *error);
MildStatus gpu_wait(int device, MildError *error);

#endif
