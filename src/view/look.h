/* What pictures show of a robot in the place of its file's shapes: meshes, which a file look.xml
 * beside it names (docs/robots.md). The step never reads them, and others beside it are drawn by
 * their shapes, because a robot has 60 000 triangles of meshes. */
#ifndef MILD_VIEW_LOOK_H
#define MILD_VIEW_LOOK_H

#include <mujoco/mujoco.h>

#include "base/paths.h"
#include "mild/error.h"

#define LOOK_HIDDEN_GROUP 5 /* of geoms that are not drawn */

/* The path of look.xml beside the robot's file `xml`, or NULL where there is none. */
const char *look_path(const char *xml, char path[PATH_SIZE]);

/* Adds the meshes of `path` to the bodies of the same names and hides the other geoms of these. */
MildStatus look_add(mjSpec *spec, const char *path, MildError *error);

#endif
