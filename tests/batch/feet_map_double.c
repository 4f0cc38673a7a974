#include "contact_robots.h"
#define HOST_ROBOT feet_map_double
#define CONTACT_MAP 1
#define CONTACT_POINTS 0
#include "ground/batch/host.inc"
