/* Ground by the name of a preset. */
#ifndef TEST_MATERIALS_H
#define TEST_MATERIALS_H

#include "kit.h"
#include "mild/ground.h"

static inline MildMaterial kit_preset(const char *name) {
    MildMaterial material;
    assert_true(mild_material_preset(name, &material));
    return material;
}

static inline MildTerrain kit_terrain(const char *name) {
    const MildMaterial material = kit_preset(name);
    return mild_terrain_uniform(&material);
}

#endif
