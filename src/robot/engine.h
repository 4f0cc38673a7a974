/* MuJoCo's failures. Out of memory its C code calls an error handler that must not return, and its
 * C++ code throws where nobody catches and aborts; by default it also writes MUJOCO_LOG.TXT into
 * the working folder. Here a failure becomes a MildError, or one line of the program. */
#ifndef ROBOT_ENGINE_H
#define ROBOT_ENGINE_H

#include "mild/error.h"

/* Calls work(context) and returns its status. When MuJoCo gives up inside, what it held is lost and
 * *error says so; `what` names the thing that was made. One thread at a time. */
MildStatus engine_call(MildStatus (*work)(void *context, MildError *error), void *context,
                       const char *what, MildError *error);

/* From now on `fatal`, which must not return, gets MuJoCo's errors outside of engine_call, as one
 * line; warnings are dropped, because numbers that go bad are counted by those who step
 * (RobotSim). */
void engine_on_error(void (*fatal)(const char *text));

#endif
