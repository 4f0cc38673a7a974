/* Models of yielding springs (Lynch et al.). */
#include "ground/law/model.h"

const ModelRow model_con_spring = {
    .info = {.summary = "one yielding spring under the middle of the sole",
             .source = "Lynch et al. 2020",
             .fields = {"k_pen", "mu", "k_drift", "b_drift", "recovery", "bed_depth", "refill"},
             .scaled = {"k_pen"},
             .concentric = 1,
             .match_note = "recovery 0"},
    .law = law_spring,
    .reference = law_spring_material,
};

const ModelRow model_ecc_spring = {
    .info = {.summary = "a yielding spring under every element",
             .source = "Lynch et al. 2024",
             .fields = {"k_pen", "mu", "k_drift", "b_drift", "recovery", "bed_depth", "refill"},
             .scaled = {"k_pen"},
             .match_note = "recovery 0"},
    .law = law_spring,
    .reference = law_spring_material,
};
