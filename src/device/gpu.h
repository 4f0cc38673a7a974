/* What device.h is on a GPU: gpu.cu, or without_cuda.c. */
#ifndef MILD_DEVICE_GPU_H
#define MILD_DEVICE_GPU_H

#include <stddef.h>

#include "mild/error.h"

MildStatus gpu_open(int device, MildError *error);
void *gpu_alloc(int device, size_t bytes, MildError *error);
void gpu_free(int device, void *memory);
MildStatus gpu_copy(int device, void *to, const void *from, size_t bytes, MildError *error);
MildStatus gpu_wait(int device, MildError *error);

#endif
