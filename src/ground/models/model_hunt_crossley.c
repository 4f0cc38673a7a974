#include "ground/law/model.h"

/* K. H. Hunt, F. R. E. Crossley, "Coefficient of restitution interpreted as damping in
 * vibroimpact", J. Appl. Mech. 42 (1975): F = k u^n (1 + 3/2 d w). To first order in the impact
 * speed v, the coefficient of restitution is 1 - d v for a body of any mass. */
static Law hunt_crossley_law(const MildMaterial *material, double pitch) {
    Law law = law_line(0.0, pitch * pitch, material->bed_depth);
    law.elastic_force = material->k_pen * POWER_DEPTH;
    law.elastic_exponent = material->exponent;
    law.elastic_damping = 1.5 * material->dissipation;
    return law;
}

/* Hertz's exponent. */
static void hunt_crossley_material(MildMaterial *material, double area) {
    (void)area;
    material->k_pen = 1.0;
    material->exponent = 1.5;
}

const ModelRow model_hunt_crossley = {
    .info = {.summary = "a damped elastic contact under every element, without memory",
             .source = "Hunt and Crossley 1975",
             .fields = {"k_pen", "exponent", "dissipation", "mu", "k_drift", "b_drift",
                        "bed_depth"},
             .scaled = {"k_pen"},
             .match_note = "exponent 1.5"},
    .law = hunt_crossley_law,
    .reference = hunt_crossley_material,
};
