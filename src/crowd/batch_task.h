/* The files of the task that a device runs, compiled for it; see task/lanes.h. */
#ifndef ENVS_TASK_TEXT_H
#define ENVS_TASK_TEXT_H

#include "task/task.h"

/* NOLINTBEGIN(bugprone-suspicious-include) */
#include "task/assist.c"
#include "task/gait.c"
#include "task/observe.c"
#include "task/randomize.c"
#include "task/reward.c"
#include "task/step.c"
/* NOLINTEND(bugprone-suspicious-include) */

#endif
