/* Steps on level ground. */
#define CONTACT_MAP 0
#define HOST_STEP host_step
#include "batch/host.inc"
