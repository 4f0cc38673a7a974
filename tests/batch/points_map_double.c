#include "contact_robots.h"
#define HOST_ROBOT points_map_double
enum { CONTACT_MAP = 1, CONTACT_POINTS = 1 };
#include "ground/batch/host.inc"
