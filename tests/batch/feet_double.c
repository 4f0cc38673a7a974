#include "contact_robots.h"
#define HOST_ROBOT feet_double
#define CONTACT_MAP 0
#define CONTACT_POINTS 0
#include "ground/batch/host.inc"
