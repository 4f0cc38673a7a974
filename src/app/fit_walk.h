/* mild fit of a robot's log: what its ground was. */
#ifndef APP_FIT_WALK_H
#define APP_FIT_WALK_H

#include "mild/error.h"

/* Prints the posterior, and each change of ground on the way. json: NULL: none. */
MildStatus fit_walk(const char *path, int trial, const char *json, MildError *error);

#endif
