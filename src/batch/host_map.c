/* Steps on a map. */
#define CONTACT_MAP 1
#define HOST_STEP host_step_map
#include "batch/host.inc"
