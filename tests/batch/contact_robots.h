/* Versions of contact.inc in Real: those of the batch in float, in double units of the test. */
#ifndef CONTACT_ROBOTS_H
#define CONTACT_ROBOTS_H

#include "ground/batch/host.h"

HostRobot feet_double, points_double, feet_map_double, points_map_double;

/* Both robots of a warp; all arrays are [LANES]. */
typedef void PairRobot(const ContactSetup *setup, const ContactProblem *problem,
                       const ContactMemory *memory, const ContactResult *result, int *done);
PairRobot pair_double, pair_float;

#endif
