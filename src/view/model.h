/* The model that is drawn: the robot's own file, a sky, and surfaces for tiles of the ground. */
#ifndef MILD_VIEW_MODEL_H
#define MILD_VIEW_MODEL_H

#include <mujoco/mujoco.h>

#include "view/relief.h"

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
 * look: path of the file with the meshes that are drawn (look.h); NULL: the file's own shapes.
 * size: [pixels] width and height of the picture.
 * Returns NULL on error. Free it with mj_deleteModel. */
mjModel *view_model(const char *xml, const char *look, const int size[2], const Relief *relief,
                    const Surfaces *surfaces, MildError *error);

#endif
