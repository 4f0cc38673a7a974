/* Files of the program: where its data lies, folders made, files written whole or not at all. */
#ifndef BASE_PATHS_H
#define BASE_PATHS_H

#include <stddef.h>

#include "mild/error.h"

enum { PATH_SIZE = 1024 };

/* Full path of a shipped file such as "models/sa01/sa01.xml" or "configs/default.ini": below
 * $MILD_HOME when set, else beside the folder of the executable (build/..), else in the source tree
 * the program was built from. */
const char *path_data(const char *relative, char path[PATH_SIZE]);

/* folder + "/" + name; fails when longer than PATH_SIZE. */
MildStatus path_join(const char *folder, const char *name, char path[PATH_SIZE], MildError *error);

/* Makes the folder and its parents; fine when it is there. */
MildStatus path_make_folder(const char *folder, MildError *error);

/* Whether path_write could begin: what stands in its way is said before the work, not after it.
 * Leaves nothing behind. */
MildStatus path_check_write(const char *path, MildError *error);

/* Writes a temporary file beside `path`, syncs, renames: after a crash or on a full disk the old
 * file is still whole. Devices and pipes are written to directly. */
MildStatus path_write(const char *path, const void *data, size_t size, MildError *error);

#endif
