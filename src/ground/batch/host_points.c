/* Feet that transmit no moment, on level ground. */
#define MILD_REAL_FLOAT
#define HOST_ROBOT host_points
enum { CONTACT_MAP = 0, CONTACT_POINTS = 1 };
#include "ground/batch/host.inc"
