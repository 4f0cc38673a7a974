/* Feet on a map. */
#define MILD_REAL_FLOAT
#define HOST_ROBOT host_feet_map
#define CONTACT_MAP 1
#define CONTACT_POINTS 0
#include "ground/batch/host.inc"
