#include "contact_robots.h"
#define HOST_ROBOT points_double
enum { CONTACT_MAP = 0, CONTACT_POINTS = 1 };
#include "ground/batch/host.inc"
