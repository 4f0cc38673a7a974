/* Memory of a device or of the CPU, copies between them, and streams beside that of a caller. A
 * device is a CUDA device, from 0, or DEVICE_HOST. */
#ifndef MILD_DEVICE_H
#define MILD_DEVICE_H

#include <stddef.h>

#include "mild/error.h"

#define DEVICE_HOST (-1) /* the CPU in the place of a device */

/* Bool-like: MILD_OK when the device is there. */
MildStatus device_open(int device, MildError *error);
/* Memory of the device, all 0. NULL with a message that says how much was asked for. */
void *device_alloc(int device, size_t bytes, MildError *error);
void device_free(int device, void *memory); /* may be NULL */
/* Copies to, from or within the device and waits. */
MildStatus device_copy(int device, void *to, const void *from, size_t bytes, MildError *error);
/* Until all that was asked of the device is done. */
MildStatus device_wait(int device, MildError *error);

/* ---- streams beside that of a caller, on a GPU ---- */
typedef struct DeviceFork DeviceFork;
DeviceFork *device_fork_create(int device, int streams, MildError *error);
void device_fork_destroy(DeviceFork *fork); /* may be NULL */
MildStream device_fork_stream(const DeviceFork *fork, int i);
/* Work put into the streams from now on waits for what is in the caller's; after device_join the
 * caller's waits for what is in them. A graph may capture both. */
MildStatus device_fork(DeviceFork *fork, MildStream stream, MildError *error);
MildStatus device_join(DeviceFork *fork, MildStream stream, MildError *error);

#endif
