/* Feet on level ground. */
#define MILD_REAL_FLOAT
#define HOST_ROBOT host_feet
enum { CONTACT_MAP = 0, CONTACT_POINTS = 0 };
#include "ground/batch/host.inc"
