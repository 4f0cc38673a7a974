#include <math.h>

#include "ground/contact.h"

MildTerrain mild_terrain_uniform(const MildMaterial *material) {
    MildTerrain terrain = {.material_count = 1};
    terrain.materials[0] = *material;
    return terrain;
}

static int patches_overlap(const MildPatch *a, const MildPatch *b) {
    return a->x_min < b->x_max && b->x_min < a->x_max && a->y_min < b->y_max && b->y_min < a->y_max;
}

MildStatus mild_terrain_add_patch(MildTerrain *terrain, const MildPatch *patch, MildError *error) {
    if (terrain->patch_count >= MILD_PATCHES_MAX)
        return mild_fail(error, MILD_ERROR_ARGUMENT, "terrain: patch_count is full, at most %d patches", MILD_PATCHES_MAX);
    if (patch->material < 0 || patch->material >= terrain->material_count)
        return mild_fail(error, MILD_ERROR_RANGE, "patch.material = %d is not one of %d materials", patch->material,
                         terrain->material_count);
    /* Written so that NaN fails; infinite edges make half planes and strips. */
    if (!(patch->x_min < patch->x_max))
        return mild_fail(error, MILD_ERROR_RANGE, "patch.x_min = %g must be below patch.x_max = %g", patch->x_min,
                         patch->x_max);
    if (!(patch->y_min < patch->y_max))
        return mild_fail(error, MILD_ERROR_RANGE, "patch.y_min = %g must be below patch.y_max = %g", patch->y_min,
                         patch->y_max);
    for (int i = 0; i < terrain->patch_count; i++)
        if (patches_overlap(&terrain->patches[i], patch))
            return mild_fail(error, MILD_ERROR_ARGUMENT, "patch.x_min .. y_max: the rectangle overlaps patch %d", i);
    terrain->patches[terrain->patch_count++] = *patch;
    return MILD_OK;
}

int mild_terrain_material_at(const MildTerrain *terrain, double x, double y) {
    for (int i = 0; i < terrain->patch_count; i++) {
        const MildPatch *patch = &terrain->patches[i];
        if (x >= patch->x_min && x < patch->x_max && y >= patch->y_min && y < patch->y_max) return patch->material;
    }
    return 0;
}

double mild_terrain_height_at(const MildTerrain *terrain, double x, double y) {
    (void)x;
    (void)y;
    return terrain->height;
}

void terrain_heights(const MildTerrain *terrain, const double *x, const double *y, int count, double *height) {
    (void)x;
    (void)y;
    for (int i = 0; i < count; i++) height[i] = terrain->height;
}
