/* Whose state it is: see soft_owns. */
#include <math.h>
#include <string.h>

#include "plugin/soft.h"

/* Bool: the header is that of a ground with these feet. */
static int has_layout(const MildGround *ground, const MildGround *layout) {
    return ground->feet == layout->feet && ground->shells == layout->shells &&
           memcmp(ground->elements, layout->elements, sizeof layout->elements) == 0 &&
           memcmp(ground->padded, layout->padded, sizeof layout->padded) == 0 &&
           ground->tiles == layout->tiles && ground->imprint_cell == layout->imprint_cell;
}

/* Bool: the step reads the elements of the foot. */
static int is_read(const Soft *soft, const MildGround *ground, int f) {
    return !soft->foot[f].shell || ground->touched[f] != 0 || (soft->input.rows >> f & 1) != 0;
}

/* Bool: a material as Memory encodes it (ground/step/state.h) is one of the terrain. */
static int is_material(const MildTerrain *terrain, int32_t code, int shell) {
    if (code < 0) {
        return code == MATERIAL_NONE || code == MATERIAL_FREE || (shell && code == MATERIAL_BURIED);
    }
    return (code & 0xff) < terrain->material_count &&
           (code >> 8 & 0xff) < terrain->material_count && code >> 24 == 0;
}

/* Bool: what a foot remembers is finite, on materials that exist. */
static int is_own(const Soft *soft, const MildGround *ground, int f) {
    const Memory memory = ground_memory(ground, f);
    const double *last = (const double *)(const void *)memory.material;
    int own = ground->touched[f] >= 0 && ground->touched[f] <= ground->padded[f];
    for (const double *at = memory.depth_max; at < last; at++) {
        own &= isfinite(*at) != 0;
    }
    for (int e = 0; e < ground->padded[f]; e++) {
        own &= is_material(&soft->terrain, memory.material[e], memory.area_share != NULL);
        own &= memory.worn[e] >= 0 && memory.worn[e] < 1;
        own &= !memory.area_share || memory.area_share[e] >= 0;
    }
    return own;
}

int soft_owns(const Soft *soft, const MildGround *ground) {
    int owns = has_layout(ground, &soft->layout);
    for (int f = 0; owns && f < soft->feet; f++) {
        owns = !is_read(soft, ground, f) || is_own(soft, ground, f);
    }
    return owns;
}
