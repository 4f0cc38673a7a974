/* The weights of a belief, from a safetensors file that lab/know/know.py writes. */
#ifndef IDENTIFY_BELIEF_FILE_H
#define IDENTIFY_BELIEF_FILE_H

#include "identify/belief/belief.h"
#include "mild/error.h"

/* The file that ships with the policy of SA01 (path_data). */
#define BELIEF_SHIPPED "policies/knows.safetensors"

/* The caller frees it. NULL, with one line in *error, for a file that is missing, damaged, or not
 * such a file. */
BeliefNet *belief_read(const char *path, MildError *error);

/* Bool: a robot of this name has weights that ship. */
int belief_has(const char *robot);
/* The shipped weights for a robot; *net is NULL for one that has none. The caller frees them. */
MildStatus belief_open(const char *robot, BeliefNet **net, MildError *error);

#endif
