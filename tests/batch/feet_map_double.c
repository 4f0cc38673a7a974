#include "contact_robots.h"
#define HOST_ROBOT feet_map_double
enum { CONTACT_MAP = 1, CONTACT_POINTS = 0 };
#include "ground/batch/host.inc"
