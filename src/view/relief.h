/* The visible ground: a height map that soles and other bodies press in and that springs back by
 * its material's `recovery`. Under a sole it is as deep as the sole; around it the surface rises in
 * a smooth slope. It is only for drawing; physics never reads it. The map is divided into square
 * tiles, so that a renderer need refresh only those that changed. It does not depend on a renderer.
 */
#ifndef VIEW_RELIEF_H
#define VIEW_RELIEF_H

#include "view/facet.h"

#define RELIEF_TILE_CELLS 64
#define RELIEF_TILE_VERTICES (RELIEF_TILE_CELLS + 1)
#define RELIEF_TILE_PIXELS 128
#define RELIEF_TILE_MARGIN 4 /* [pixels] border around a tile's picture for texture filtering */
#define RELIEF_RIGID (-1)    /* material index of ground that never yields */

typedef struct {
    double x_min, x_max, y_min, y_max; /* [m] area drawn; rounded up to whole tiles */
    double cell;                       /* [m] distance of vertices */
    int rigid;                         /* bool: nothing yields */
    const char *const *names; /* [materials] preset names, for colours; NULL entries allowed */
    int robots;               /* that press it, each with all its feet */
} ReliefDef;

typedef struct Relief Relief;

/* soles: [feet], borrowed. The terrain is copied, its map borrowed. */
Relief *relief_create(const ReliefDef *def, const MildTerrain *terrain,
                      const MildSole *const *soles, int feet, MildError *error);
void relief_destroy(Relief *relief);
/* Presses the surface to the present pose of a robot's soles. position [feet][3], rotation
 * [feet][9]: of the ankles. */
void relief_press(Relief *relief, int robot, const double (*position)[3],
                  const double (*rotation)[9]);
/* The same of the other bodies in the ground, by their elements [count], which are borrowed until
 * the next call. */
void relief_press_facets(Relief *relief, const Facet *facets, int count);

int relief_tile_columns(const Relief *relief); /* along x */
int relief_tile_rows(const Relief *relief);    /* along y */
double relief_tile_edge(const Relief *relief); /* [m] */
void relief_tile_center(const Relief *relief, int tile, double center[2]);
int relief_is_uneven(const Relief *relief);
/* [m] of the undisturbed surface: lowest of the area drawn, and at a point. */
double relief_low(const Relief *relief);
double relief_height_at(const Relief *relief, double x, double y);
/* The one material of the tile (RELIEF_RIGID where nothing yields), or -2 when several meet in it.
 */
int relief_tile_material(const Relief *relief, int tile);
/* Whether a vertex of the tile lies below the undisturbed surface: never again on elastic ground
 * once the foot has left. */
int relief_tile_pressed(const Relief *relief, int tile);
/* Whether the tile changed since the last call. */
int relief_tile_take_dirty(Relief *relief, int tile);
/* Position [m, world] and unit normal of every step-th vertex (a divisor of RELIEF_TILE_CELLS),
 * rows along y, x fastest: [n][n][3] each, n = RELIEF_TILE_CELLS/step + 1. Tiles share their edges.
 */
void relief_tile_surface(const Relief *relief, int tile, int step, float *position, float *normal);
/* [m] Depth of the drawn surface below the undisturbed one, linear between vertices; 0 outside. */
double relief_depth_at(const Relief *relief, double x, double y);
/* [PIXELS][PIXELS][3] first row at y max, margin included; pressed ground is darker. */
void relief_tile_pixels(const Relief *relief, int tile, unsigned char *rgb);
/* The same for untouched ground of one material, seamless between tiles. */
void relief_flat_pixels(const Relief *relief, int material, unsigned char *rgb);

#endif
