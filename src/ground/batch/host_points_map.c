/* Feet that transmit no moment, on a map. */
#define MILD_REAL_FLOAT
#define HOST_ROBOT host_points_map
enum { CONTACT_MAP = 1, CONTACT_POINTS = 1 };
#include "ground/batch/host.inc"
