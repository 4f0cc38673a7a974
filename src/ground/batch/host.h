/* The step of one robot on the CPU: a version of contact.inc in each file, since they take long to
 * compile. */
#ifndef MILD_BATCH_HOST_STEP_H
#define MILD_BATCH_HOST_STEP_H

#include "ground/batch/contact.h"

typedef void HostRobot(const ContactSetup *setup, const ContactProblem *problem,
                       const ContactMemory *memory, int advance, const ContactResult *result);
HostRobot host_feet, host_points, host_feet_map, host_points_map; /* in float */

#endif
