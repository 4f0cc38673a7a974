/* One environment, top to bottom: observe, reward, randomise, terminate; and many of them over all cores, writing
 * straight into the learner's batch. Same seed, same numbers, whatever the thread count. */
#ifndef MILD_TASK_H
#define MILD_TASK_H

#include <stdint.h>

#include "base/pool.h"
#include "mild/error.h"
#include "mild/field.h"
#include "robot/robot.h"

#define TASK_OBSERVATION 47 /* one frame (learning.md section 3) */
#define TASK_FRAMES 6       /* H + 1, newest last */
#define TASK_ACTIONS 12
#define TASK_ESTIMATES 11
#define TASK_REWARDS 24
#define TASK_CRITIC 98
#define TASK_POLICY_HZ 100

typedef struct TaskDef TaskDef; /* all of the task's config; see task_def.h */

extern const int task_mirror_observation_index[TASK_OBSERVATION];
extern const float task_mirror_observation_sign[TASK_OBSERVATION];
extern const int task_mirror_action_index[TASK_ACTIONS];
extern const float task_mirror_action_sign[TASK_ACTIONS];

#endif
