/* What the tests of maps and of contact on them share. */
#ifndef MAP_KIT_H
#define MAP_KIT_H

#include "ground_kit.h"

static inline MildMap *make_map(const MildMapDef *def) {
    MildError error = {0};
    MildMap *map = mild_map_create(def, &error);
    expect_good(map != NULL, &error);
    return map;
}

static inline MildMapDef shape(MildMapKind kind, double amplitude, double wavelength) {
    MildMapDef def = mild_map_def_default();
    def.kind = (int)kind;
    def.amplitude = amplitude;
    def.wavelength = wavelength;
    return def;
}

static inline MildTerrain terrain_on(const MildMap *map, double height) {
    MildMaterial m = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&m);
    terrain.height = height;
    for (; terrain.material_count < MILD_MATERIALS_MAX; terrain.material_count++) {
        terrain.materials[terrain.material_count] = m;
    }
    MildError error = {0};
    expect_good(mild_terrain_set_map(&terrain, map, &error) == MILD_OK, &error);
    return terrain;
}

#endif
