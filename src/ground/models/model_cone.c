/* Models whose elements are developing cones: the paper's, with its cones merged, and one cone
 * under the whole sole. */
#include "ground/law/model.h"

const ModelRow model_mild = {
    .info = {.summary = "a developing cone under every element",
             .source = "the paper",
             .fields = {"k_pen", "sigma_cone", "alpha", "nu", "c_g", "c_d", "phi", "rho", "mu",
                        "k_drift", "b_drift", "recovery", "bed_depth", "passive", "slip_length",
                        "regain_length", "grip", "slip_growth", "refill"},
             .scaled = {"k_pen", "sigma_cone"}},
    .law = law_cone,
    .slips = 1,
};

const ModelRow model_mild_merged = {
    .info = {.summary = "the cones of one sole merge into a heap on its outline",
             .source = "docs/model.md, section 21; Nadai 1931 for the heap",
             .fields = {"k_pen", "sigma_cone", "alpha", "nu", "c_g", "c_d", "phi", "rho", "mu",
                        "k_drift", "b_drift", "recovery", "bed_depth", "passive", "slip_length",
                        "regain_length", "grip", "slip_growth", "refill"},
             .scaled = {"k_pen", "sigma_cone"}},
    .law = law_cone,
    .merged = 1,
    .slips = 1,
};

/* Parameters of Choi et al. 2023 for a foot of area A, with k = 1e6 N/m^3 A. */
#define CHOI_STRESS 1e6   /* [N/m^3] k/A */
#define CHOI_SIGMA 0.15e6 /* [N/m^3] */
#define CHOI_ALPHA (LAW_PI / 3.0)

static void choi_material(MildMaterial *m, double area) {
    m->alpha = CHOI_ALPHA;
    m->nu = 2.0;
    m->c_g = 2.7;
    m->c_d = 17.2;
    m->phi = 0.57;
    m->rho = 1000.0;
    m->k_pen = CHOI_STRESS * area;
    m->sigma_cone = CHOI_SIGMA;
}

const ModelRow model_con_cone = {
    .info = {.summary = "one developing cone under the whole sole",
             .source = "Choi et al. 2023, scaled",
             .fields = {"k_pen", "sigma_cone", "alpha", "nu", "c_g", "c_d", "phi", "rho", "mu",
                        "k_drift", "b_drift", "recovery", "bed_depth", "refill", "passive"},
             .scaled = {"k_pen", "sigma_cone"},
             .match_note = "alpha 1.047, nu 2, c_g 2.7, c_d 17.2, phi 0.57, rho 1000 (Choi)",
             .concentric = 1},
    .law = law_cone,
    .reference = choi_material,
};
