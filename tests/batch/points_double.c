#include "contact_robots.h"
#define HOST_ROBOT points_double
#define CONTACT_MAP 0
#define CONTACT_POINTS 1
#include "ground/batch/host.inc"
