/* The step of one robot on the CPU, for those that have its engine in the same code. In float. */
#ifndef MILD_BATCH_HOST_STEP_H
#define MILD_BATCH_HOST_STEP_H

#include "ground/batch/batch.h"
#include "ground/batch/contact.h"

#include "ground/batch/robot.inc"

typedef void (*HostRobot)(const ContactSetup *setup, const ContactProblem *problem,
                          ContactMemory memory, int advance, const ContactResult *result);
/* The version that is compiled for these soles, level or on a map. */
HostRobot host_robot(const BatchShape *shape);
HostRobot host_robot_map(const BatchShape *shape); /* on a map */

#endif
