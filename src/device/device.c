#include "device/device.h"

#include <stdlib.h>
#include <string.h>

#include "device/gpu.h"

MildStatus device_open(int device, MildError *error) {
    return device == DEVICE_HOST ? MILD_OK : gpu_open(device, error);
}

void *device_alloc(int device, size_t bytes, MildError *error) {
    if (device != DEVICE_HOST) {
        return gpu_alloc(device, bytes, error);
    }
    void *memory = calloc(1, bytes);
    if (!memory) {
        mild_fail(error, MILD_ERROR_MEMORY, "out of memory: %zu bytes are needed", bytes);
    }
    return memory;
}

void device_free(int device, void *memory) {
    if (device != DEVICE_HOST) {
        gpu_free(device, memory);
    } else {
        free(memory);
    }
}

MildStatus device_copy(int device, void *to, const void *from, size_t bytes, MildError *error) {
    if (device != DEVICE_HOST) {
        return gpu_copy(device, to, from, bytes, error);
    }
    memcpy(to, from, bytes);
    return MILD_OK;
}

MildStatus device_wait(int device, MildError *error) {
    return device == DEVICE_HOST ? MILD_OK : gpu_wait(device, error);
}
