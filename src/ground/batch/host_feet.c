/* Feet on level ground. */
#define MILD_REAL_FLOAT
#define HOST_ROBOT host_feet
#define CONTACT_MAP 0
#define CONTACT_POINTS 0
#include "ground/batch/host.inc"
