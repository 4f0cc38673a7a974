/* What the file of a policy says of its training. */
#ifndef APP_TRAINED_H
#define APP_TRAINED_H

#include "task/task_def.h"

/* Says on standard error, in one line, that `task` has another number than the config with which
 * the policy was trained, of those that the policy walks by, such as the gait's period. Nothing is
 * said when the user gives a config (not NULL), or when the one of the training is not here. */
void trained_tell(const char *command, const char *policy, const char *config, const TaskDef *task);

#endif
