#include "know/know.h"

#include <math.h>
#include <string.h>

static double draw_log(Random *r, double low, double high) {
    return low * exp(random_unit(r) * log(high / low));
}

static void draw_wide(Random *r, MildMaterial *m) {
#define PRIOR_DRAW(name, unit, low, high) m->name = draw_log(r, low, high);
    PRIOR_LIST(PRIOR_DRAW)
#undef PRIOR_DRAW
}

static void draw_paper(Random *r, MildMaterial *m) {
    m->k_pen = draw_log(r, 150, 1400);
    m->sigma_cone = draw_log(r, 8e4, 2.4e5);
    m->slip_length = draw_log(r, PRIOR_NO_SLIP, 1); /* none */
}

PriorGround prior_ground(const MildMaterial *material, const MildSole *sole, double load) {
    return (PriorGround){.sinkage = mild_sole_sinkage(sole, material, load),
                         .k_pen = material->k_pen,
                         .sigma_cone = material->sigma_cone,
                         .mu = material->mu,
                         .slip_length = material->slip_length > 0 ? material->slip_length : 1,
                         .preset = -1};
}

static int is_of_paper(const char *preset) {
    return strcmp(preset, "foam45") == 0 || strcmp(preset, "grass") == 0 ||
           strcmp(preset, "sand_loose") == 0;
}

PriorGround prior_draw(Prior prior, Random *r, const MildSole *sole, double load,
                       MildMaterial *material) {
    PriorGround ground;
    int preset;
    do {
        do {
            preset = (int)random_index(r, (uint32_t)mild_material_preset_count());
        } while (prior == PRIOR_PAPER && !is_of_paper(mild_material_preset_name(preset)));
        *material = mild_material_default();
        mild_material_preset(mild_material_preset_name(preset), material);
        mild_model_match(MILD_MODEL_MILD, material, sole, load, material, NULL);
        if (prior == PRIOR_PAPER) {
            draw_paper(r, material);
        } else if (prior == PRIOR_WIDE) {
            draw_wide(r, material);
        }
        ground = prior_ground(material, sole, load);
        ground.preset = preset;
    } while (!(ground.sinkage <= PRIOR_SINKAGE));
    if (material->slip_length >= PRIOR_NO_SLIP) {
        material->slip_length = 0;
    }
    return ground;
}
