/* The model that is drawn: the robot's own file, a sky, and surfaces for tiles of the ground. */
#ifndef MILD_VIEW_MODEL_H
#define MILD_VIEW_MODEL_H

#include <mujoco/mujoco.h>

#include "base/paths.h"
#include "mild/error.h"
#include "view/relief.h"

/* What pictures show of a robot in the place of its file's shapes: meshes, which a file look.xml
 * beside it names (docs/robots.md). The step never reads them, and others beside it are drawn by
 * their shapes, because a robot has 60 000 triangles of meshes. */

#define LOOK_HIDDEN_GROUP 5 /* of geoms that are not drawn */

/* The path of look.xml beside the robot's file `xml`, or NULL where there is none. */
const char *look_path(const char *xml, char path[PATH_SIZE]);

#define VIEW_COARSE 4 /* [vertices] spacing of drawn vertices on a tile without imprints */

/* Surfaces that view.c lends to tiles. */
typedef struct {
    int plain; /* the first of them have coarse vertices, for tiles without imprints */
    int all;
} Surfaces;

/* Adds to the file `xml`:
 * surface i: a skin, a texture and a material named view_tile_i;
 * material m, and the rigid ground behind the last one: a texture and a material named view_flat_m;
 * the floor around: view_floor.
 * look: path of the file with the meshes that are drawn (look_path); NULL: the file's own shapes.
 * size: [pixels] width and height of the picture.
 * Returns NULL on error. Free it with mj_deleteModel. */
mjModel *view_model(const char *xml, const char *look, const int size[2], const Relief *relief,
                    const Surfaces *surfaces, MildError *error);

#endif
