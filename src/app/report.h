/* Result files: JSON made with cJSON, written whole or not at all. */
#ifndef MILD_REPORT_H
#define MILD_REPORT_H

#include <cjson/cJSON.h>

#include "mild/error.h"

/* Takes ownership of `root` (NULL: out of memory while it was built). path "-": to stdout. */
MildStatus report_save(cJSON *root, const char *path, MildError *error);

#endif
