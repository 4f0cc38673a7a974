/* The weights of a belief, from a safetensors file that scripts/know.py writes. */
#ifndef IDENTIFY_BELIEF_FILE_H
#define IDENTIFY_BELIEF_FILE_H

#include "identify/belief/belief.h"
#include "mild/error.h"

/* The file that ships with the robot's policy, under the folder of the data (data_path). */
#define BELIEF_SHIPPED "policies/knows.safetensors"

/* The caller frees it. NULL, with one line in *error, for a file that is missing, damaged, or not
 * such a file. */
BeliefNet *belief_read(const char *path, MildError *error);

#endif
