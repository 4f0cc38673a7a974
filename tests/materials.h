/* The paper's ground by the name of a preset: of mild, and slip costs nothing. */
#ifndef TEST_MATERIALS_H
#define TEST_MATERIALS_H

#include <string.h>

#include "kit.h"
#include "mild/ground.h"

static inline MildMaterial kit_preset(const char *name) {
    MildMaterial material;
    assert_true(mild_material_preset(name, &material));
    if (material.model == MILD_MODEL_MILD_MERGED) {
        const int loose = strcmp(name, "sand_loose") == 0;
        material.model = MILD_MODEL_MILD;
        material.k_pen = loose ? 380 : 700;
        material.sigma_cone = loose ? 0.15e6 : 0.24e6;
        material.slip_length = material.grip = material.slip_growth = 0;
    }
    return material;
}

static inline MildTerrain kit_terrain(const char *name) {
    const MildMaterial material = kit_preset(name);
    return mild_terrain_uniform(&material);
}

#endif
