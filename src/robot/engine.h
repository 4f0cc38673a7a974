/* Handles MuJoCo's failures. When memory runs out, its C code calls an error handler that must not
 * return, and its C++ code throws an exception that nobody catches, which aborts. By default it
 * also writes MUJOCO_LOG.TXT into the working folder. Here a failure becomes a MildError, or a
 * single line of the program. */
#ifndef ROBOT_ENGINE_H
#define ROBOT_ENGINE_H

#include "mild/error.h"

/* Calls work(context) and returns its status. When MuJoCo gives up inside, its memory is leaked and
 * *error gives the reason. `what` names the thing that was being made. One thread at a time. */
MildStatus engine_call(MildStatus (*work)(void *context, MildError *error), void *context,
                       const char *what, MildError *error);

/* From now on, MuJoCo's errors outside of engine_call are passed to `fatal`, as one line; it must
 * not return. Warnings are ignored, because callers of robot_sim_step count divergence
 * themselves. */
void engine_on_error(void (*fatal)(const char *text));

#endif
