/* The paper's grounds: a preset by its name, of mild, and slip costs nothing. */
#ifndef TEST_MATERIALS_H
#define TEST_MATERIALS_H

#include <string.h>

#include "kit.h"
#include "mild/ground.h"

enum { PAPER_PRESETS = 8 }; /* the first ones */

static inline MildMaterial kit_preset(const char *name) {
    MildMaterial material;
    assert_true(mild_material_preset(name, &material));
    if (material.model == MILD_MODEL_MILD_MERGED) {
        const int loose = strcmp(name, "sand_loose") == 0;
        const int of_paper = loose || strcmp(name, "sand_dense") == 0;
        material.model = MILD_MODEL_MILD;
        material.k_pen = !of_paper ? material.k_pen : loose ? 380 : 700;
        material.sigma_cone = !of_paper ? material.sigma_cone : loose ? 0.15e6 : 0.24e6;
        material.slip_length = material.grip = material.slip_growth = 0;
    }
    return material;
}

static inline MildTerrain kit_terrain(const char *name) {
    const MildMaterial material = kit_preset(name);
    return mild_terrain_uniform(&material);
}

#endif
