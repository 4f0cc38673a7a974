/* The keys of [task] that decide what a policy sees, what becomes of its actions, and how deep the
 * robot's shells may dip. A policy's file has them, so that it walks as it was trained to. */
#ifndef TASK_POLICY_KEYS_H
#define TASK_POLICY_KEYS_H

#include "env/task/task_def.h"

/* "gait_period = 0.8; clock = true; ...". size: [B] enough for the keys' longest values, or the
 * text is empty. */
void task_policy_keys_print(const TaskDef *def, char *text, size_t size);
/* Sets the keys that are in such a text. Fails on any other key, and on values out of range. */
MildStatus task_policy_keys_read(TaskDef *def, const char *text, MildError *error);

#endif
