/* Limits on the size of a robot. */
#ifndef ROBOT_LIMITS_H
#define ROBOT_LIMITS_H

#include "mild/batch.h"

#define ROBOT_JOINTS_MAX 40
#define ROBOT_FEET_MAX MILD_BATCH_PLANES_MAX
#define ROBOT_NQ_MAX (7 + ROBOT_JOINTS_MAX) /* qpos of a free base and hinges */
#define ROBOT_NV_MAX (6 + ROBOT_JOINTS_MAX) /* qvel */

#endif
