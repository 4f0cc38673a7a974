/* The files of the task that a device runs, compiled for it; see task/lanes.h. */
#ifndef ENVS_TASK_TEXT_H
#define ENVS_TASK_TEXT_H

#include "env/task/task.h"

/* NOLINTBEGIN(bugprone-suspicious-include) */
#include "env/task/assist.c"
#include "env/task/gait.c"
#include "env/task/observe.c"
#include "env/task/randomize.c"
#include "env/task/reward.c"
#include "env/task/step.c"
/* NOLINTEND(bugprone-suspicious-include) */

#endif
