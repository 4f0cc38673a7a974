/* The files of an MJCF: itself and whatever it names (includes, meshes, textures). MuJoCo reads
 * them through file_read, which refuses pipes, devices and the program's outputs. */
#ifndef ROBOT_FILES_H
#define ROBOT_FILES_H

#include <mujoco/mujoco.h>

#include "mild/error.h"

typedef struct {
    mjVFS vfs;
    mjpResourceProvider provider;
    MildError refused; /* why the first file was refused that exists */
} RobotFiles;

/* Parses the MJCF at `path`. Returns NULL on failure, with one line that begins with the path, or
 * with that of the file that was refused, in *error. Afterwards robot_files_end is called. */
mjSpec *robot_files_parse(RobotFiles *files, const char *path, MildError *error);
/* Compiles what was parsed. Returns NULL on failure as above. */
mjModel *robot_files_compile(RobotFiles *files, mjSpec *spec, const char *path, MildError *error);
void robot_files_end(RobotFiles *files);

#endif
