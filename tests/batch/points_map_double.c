#include "contact_robots.h"
#define HOST_ROBOT points_map_double
#define CONTACT_MAP 1
#define CONTACT_POINTS 1
#include "ground/batch/host.inc"
