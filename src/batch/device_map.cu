/* Steps on a map: in a file of its own, since it takes minutes to compile. */
#define CONTACT_MAP 1
#define DEVICE_STEP batch_gpu_step_map
#include "batch/device.inc"
