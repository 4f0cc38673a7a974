/* Versions of contact.inc in Real: those of the batch in float, in double units of the test. */
#ifndef CONTACT_ROBOTS_H
#define CONTACT_ROBOTS_H

#include "ground/batch/host.h"

HostRobot feet_double, points_double, feet_map_double, points_map_double;

#endif
