#include "contact_robots.h"
#define HOST_ROBOT feet_double
enum { CONTACT_MAP = 0, CONTACT_POINTS = 0 };
#include "ground/batch/host.inc"
