/* Feet that transmit no moment, on level ground. */
#define MILD_REAL_FLOAT
#define HOST_ROBOT host_points
#define CONTACT_MAP 0
#define CONTACT_POINTS 1
#include "ground/batch/host.inc"
