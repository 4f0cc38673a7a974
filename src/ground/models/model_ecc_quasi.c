#include "ground/law/model.h"
#include "ground/models/resist.h"

const ModelRow model_ecc_quasi = {
    .info = {.summary = "resistive force theory under every element",
             .source = "Li et al. 2013, Xiong et al. 2017",
             .fields = {"zeta", "mu", "k_drift", "b_drift", "bed_depth", "refill"},
             .scaled = {"zeta"},
             .match_note = "recovery 0; mu, k_drift, b_drift 0: friction is part of zeta"},
    .law = resist_law,
    .reference = resist_material,
    .motion = LAW_PLANE,
    .direction = resist_plane,
};
