/* The table of MILD_MODEL_LIST. The models' files define its rows. */
#include "ground/law/models.h"

#include "ground/sole/sole.h"

#include <math.h>
#include <string.h>

#define REGAIN_LEAST 1e-4 /* [m] share.h: no shorter than the elastic travel */

#define MODEL_DECLARE(id, name) extern const ModelRow model_##name;
MILD_MODEL_LIST(MODEL_DECLARE)

const ModelRow model_rigid = {
    .info = {.summary = "the engine's own contact, in train, eval and play; no parameters",
             .source = "MuJoCo"},
};

#define MODEL_ROW(id, name) &model_##name,
static const ModelRow *const rows[MILD_MODELS] = {MILD_MODEL_LIST(MODEL_ROW)};

#define MODEL_NAME(id, name) #name,
const char *const mild_model_names[MILD_MODELS] = {MILD_MODEL_LIST(MODEL_NAME)};

int mild_model_find(const char *name, MildModel *model) {
    for (int i = 0; i < MILD_MODELS; i++) {
        if (strcmp(mild_model_names[i], name) == 0) {
            *model = (MildModel)i;
            return 1;
        }
    }
    return 0;
}

const MildModelInfo *mild_model_info(MildModel model) {
    return &rows[model]->info;
}

int mild_model_is_concentric(MildModel model) {
    return mild_model_info(model)->concentric;
}

const ModelRow *model_row(int model) {
    const int known = model >= 0 && model < MILD_MODELS && rows[model]->law;
    return rows[known ? model : MILD_MODEL_MILD];
}

int model_is_cones(int model) {
    return model == MILD_MODEL_MILD || model == MILD_MODEL_MILD_MERGED;
}

MildMaterial material_at(const MildMaterial *material, double pitch) {
    const double r = model_row(material->model)->info.concentric ? 1.0 : pitch / MATERIAL_PITCH;
    MildMaterial own = *material;
    own.k_pen *= r * r;
    own.k_drift *= r * r;
    own.b_drift *= r * r;
    own.nu *= r;
    own.c_g /= r;
    return own;
}

Law law_of(const MildMaterial *material, double pitch, double width) {
    MildMaterial loaded = material_at(material, pitch);
    if (loaded.plate_width == 0.0) {
        loaded.plate_width = fmax(width, MATERIAL_PLATE_MIN);
    }
    return model_row(material->model)->law(&loaded, pitch);
}

Share share_of(const MildMaterial *material, double pitch, double width) {
    const ModelRow *row = model_row(material->model);
    const int slips = row->slips && material->slip_length > 0.0;
    const int sides = slips && material->grip > 0.0 && width > 0.0;
    const double weight = material->phi * material->rho * SHARE_GRAVITY; /* [N/m^3] */
    return (Share){.projects = (Real)row->merged,
                   .slip_rate = slips ? 1.0 / material->slip_length : 0.0,
                   .regain_rate = row->merged || slips
                                      ? 1.0 / fmax(material->regain_length, REGAIN_LEAST)
                                      : 0.0,
                   .grip = slips ? material->grip : 0.0,
                   .growth = slips ? material->slip_growth / material->slip_length : 0.0,
                   .side = sides ? SHARE_PASSIVE / 2.0 * weight * pitch * pitch / width : 0.0,
                   .mu = material->mu};
}

int curves_of(const MildMaterial *material, const Law *law) {
    const Share share = share_of(material, 0.0, 0.0);
    return law_curves(law) | (share.projects + share.slip_rate > 0.0 ? LAW_HEAP : 0);
}

double recovery_of(const MildMaterial *material) {
    return model_row(material->model)->motion & LAW_RESIST ? 0.0 : material->recovery;
}
