#include "ground/law/model.h"

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
