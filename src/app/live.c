#include "app/live.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double key_factor = 1.1; /* of friction or stiffness, a key */

Live live_begin(const MildTerrain *terrain, int presets) {
    Live live = {.terrain = *terrain, .presets = presets};
    memcpy(live.original, terrain->materials, sizeof live.original);
    return live;
}

/* Names of the fields that are the stiffness of a model; NULL ends them. */
static const char *const *stiffness_of(int model) {
    return mild_model_info((MildModel)model)->scaled;
}

static double *number_of(MildMaterial *material, const char *name) {
    const MildField *field =
        mild_field_find(mild_material_fields, mild_material_field_count, name, NULL);
    return (double *)(void *)((char *)material + field->offset);
}

/* Changes a material unless that leaves its range. */
static void scale(MildMaterial *material, double friction, double stiffness) {
    MildMaterial wanted = *material;
    const char *const *names = stiffness_of(material->model);
    wanted.mu *= friction;
    for (int i = 0; i < MILD_MODEL_SCALED && names[i]; i++) {
        *number_of(&wanted, names[i]) *= stiffness;
    }
    if (mild_material_check(&wanted, NULL) == MILD_OK) {
        *material = wanted;
    }
}

int live_take(Live *live, int material, const WindowInput *input) {
    MildTerrain *terrain = &live->terrain;
    if (input->friction != 0 || input->stiffness != 0) {
        scale(&terrain->materials[material], pow(key_factor, input->friction),
              pow(key_factor, input->stiffness));
    }
    if (input->ground < 1 || input->ground > live->presets) {
        return 0;
    }
    const int chosen = terrain->material_count - live->presets + input->ground - 1;
    terrain->materials[chosen] = live->original[chosen];
    terrain->patches[0] = (MildPatch){-INFINITY, INFINITY, -INFINITY, INFINITY, chosen};
    terrain->patch_count = 1;
    return 1;
}

void live_apply(const Live *live, MildTerrain *terrain) {
    memcpy(terrain->materials, live->terrain.materials, sizeof terrain->materials);
    memcpy(terrain->patches, live->terrain.patches, sizeof terrain->patches);
    terrain->patch_count = live->terrain.patch_count;
}

const char *live_describe(const Live *live, int material, char *text, size_t size) {
    MildMaterial now = live->terrain.materials[material];
    const char *name = stiffness_of(now.model)[0];
    snprintf(text, size, "friction %.2f (F V), %s %.4g (K M)", now.mu, name,
             *number_of(&now, name));
    return text;
}
