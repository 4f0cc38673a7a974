#include "ground/terrain/terrain.h"

#include <math.h>

#include "ground/terrain/grid.h"

MildTerrain mild_terrain_uniform(const MildMaterial *material) {
    MildTerrain terrain = {.material_count = 1};
    terrain.materials[0] = *material;
    return terrain;
}

static int patches_overlap(const MildPatch *a, const MildPatch *b) {
    return a->x_min < b->x_max && b->x_min < a->x_max && a->y_min < b->y_max && b->y_min < a->y_max;
}

MildStatus mild_terrain_add_patch(MildTerrain *terrain, const MildPatch *patch, MildError *error) {
    if (terrain->patch_count >= MILD_PATCHES_MAX) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "terrain.patch_count: at most %d patches are allowed", MILD_PATCHES_MAX);
    }
    if (patch->material < 0 || patch->material >= terrain->material_count) {
        return mild_fail(error, MILD_ERROR_RANGE, "patch.material = %d is not one of %d materials",
                         patch->material, terrain->material_count);
    }
    /* The comparisons are written so that NaN fails. Infinite edges make half planes and strips. */
    if (!(patch->x_min < patch->x_max)) {
        return mild_fail(error, MILD_ERROR_RANGE, "patch.x_min = %g must be below patch.x_max = %g",
                         patch->x_min, patch->x_max);
    }
    if (!(patch->y_min < patch->y_max)) {
        return mild_fail(error, MILD_ERROR_RANGE, "patch.y_min = %g must be below patch.y_max = %g",
                         patch->y_min, patch->y_max);
    }
    for (int i = 0; i < terrain->patch_count; i++) {
        if (patches_overlap(&terrain->patches[i], patch)) {
            return mild_fail(error, MILD_ERROR_ARGUMENT,
                             "patch.x_min .. patch.y_max: the rectangle overlaps patch %d", i);
        }
    }
    terrain->patches[terrain->patch_count++] = *patch;
    return MILD_OK;
}

MildStatus mild_terrain_set_map(MildTerrain *terrain, const MildMap *map, MildError *error) {
    if (map && map->label_count > terrain->material_count) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "terrain.map: label %d has no material, the terrain has only %d",
                         map->label_count - 1, terrain->material_count);
    }
    terrain->map = map;
    return MILD_OK;
}

/* A patch takes precedence over the map. */
static Label terrain_label(const MildTerrain *terrain, double x, double y) {
    for (int i = 0; i < terrain->patch_count; i++) {
        const MildPatch *patch = &terrain->patches[i];
        if (x >= patch->x_min && x < patch->x_max && y >= patch->y_min && y < patch->y_max) {
            return (Label){(unsigned char)patch->material, 0, 0};
        }
    }
    return terrain->map ? map_label(terrain->map, x - terrain->map_x, y - terrain->map_y)
                        : (Label){0, 0, 0};
}

int mild_terrain_material_at(const MildTerrain *terrain, double x, double y) {
    return terrain_label(terrain, x, y).first;
}

MildBlend mild_terrain_blend_at(const MildTerrain *terrain, double x, double y) {
    Label label = terrain_label(terrain, x, y);
    return (MildBlend){label.first, label.second, label.share / 255.0};
}

int32_t terrain_mixture(const MildTerrain *terrain, double x, double y) {
    Label label = terrain_label(terrain, x, y);
    return label.first | label.second << 8 | label.share << 16;
}

int terrain_is_level(const MildTerrain *terrain) {
    return !terrain->map || mild_map_is_level(terrain->map);
}

int terrain_is_uniform(const MildTerrain *terrain) {
    return terrain->patch_count == 0 && (!terrain->map || !terrain->map->label);
}

double terrain_steepest(const MildTerrain *terrain) {
    return terrain->map ? terrain->map->steepest : 0.0;
}

double terrain_surface(const MildTerrain *terrain, double x, double y, double slope[2]) {
    slope[0] = slope[1] = 0.0;
    double height = terrain->map
                        ? map_surface(terrain->map, x - terrain->map_x, y - terrain->map_y, slope)
                        : 0.0;
    return terrain->height + height;
}

double mild_terrain_height_at(const MildTerrain *terrain, double x, double y) {
    double slope[2];
    return terrain_surface(terrain, x, y, slope);
}

void mild_terrain_slope_at(const MildTerrain *terrain, double x, double y, double slope[2]) {
    terrain_surface(terrain, x, y, slope);
}
