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
