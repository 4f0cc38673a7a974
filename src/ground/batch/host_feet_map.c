/* Feet on a map. */
#define MILD_REAL_FLOAT
#define HOST_ROBOT host_feet_map
enum { CONTACT_MAP = 1, CONTACT_POINTS = 0 };
#include "ground/batch/host.inc"
