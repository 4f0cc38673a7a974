/* Section [terrain] of a config: the shape of the ground, the pattern of its materials, and
 * imprints. */
#ifndef TASK_TERRAIN_H
#define TASK_TERRAIN_H

#include "mild/field.h"
#include "mild/map.h"

typedef struct {
    MildMapDef map;
    char image[200], labels[200]; /* PNG files of kind = image and patches = image */
    int memory;                   /* bool: imprints stay */
    int tiles;                    /* of imprints, see mild_ground_bytes_imprints */
} TerrainDef;

TerrainDef terrain_def_default(void);
/* The keys of a TerrainDef, [*count]. */
const MildField *terrain_fields(int *count);

/* Makes the map that `def` describes, for `materials` materials. Black in a label image is the
 * first material, white the last. *map is NULL for level ground without a pattern. Destroy it with
 * mild_map_destroy. */
MildStatus terrain_make(const TerrainDef *def, int materials, MildMap **map, MildError *error);
/* The same with stripes across x of lengths drawn from `length` [m], whose labels, 0 .. materials
 * - 1, are drawn too: patches for the batch engine, which has those of a map alone. def has no
 * pattern of its own. */
MildStatus terrain_make_striped(const TerrainDef *def, int materials, const double length[2],
                                uint64_t seed, MildMap **map, MildError *error);
/* Tiles for mild_ground_bytes_imprints; 0 without memory. */
int terrain_imprint_tiles(const TerrainDef *def);

#endif
