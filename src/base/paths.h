/* Paths: finds the program's data, joins names, makes folders. */
#ifndef BASE_PATHS_H
#define BASE_PATHS_H

#include <stddef.h>

#include "mild/error.h"

enum { PATH_SIZE = 1024 };

/* Full path of a shipped file such as "robots/sa01/robot.ini" or "configs/default.ini". It is
 * looked for under $MILD_HOME if that is set, otherwise beside the folder of the executable
 * (build/..), otherwise in share/mild there (/usr/bin/../share/mild), otherwise in the folder that
 * the build names (MILD_DATA_DIR: the source tree). */
const char *path_data(const char *relative, char path[PATH_SIZE]);

/* A file as a user names it: `name` itself where it is there, otherwise the shipped file of that
 * name, such as "configs/quick.ini" in any folder. */
const char *path_given(const char *name, char path[PATH_SIZE]);

/* The executable; empty when unknown. */
const char *path_program(char path[PATH_SIZE]);

/* A file in the folder that holds the executable; empty when unknown or too long. */
const char *path_beside_program(const char *name, char path[PATH_SIZE]);

/* folder + "/" + name; fails when longer than PATH_SIZE. */
MildStatus path_join(const char *folder, const char *name, char path[PATH_SIZE], MildError *error);

/* Replaces the extension of `file` by `ending`: "runs/a.png" with "_fit.csv" gives
 * "runs/a_fit.csv". */
MildStatus path_beside(const char *file, const char *ending, char path[PATH_SIZE],
                       MildError *error);

/* Makes the folder and its parents, unless they exist. */
MildStatus path_make_folder(const char *folder, MildError *error);

#endif
