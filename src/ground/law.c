#include "ground/law.h"

#include "ground/material.h"

int model_is_resistive(int model) {
    return model == MILD_MODEL_ECC_QUASI || model == MILD_MODEL_ECC_QUASI_3D;
}

/* F = slope u. The cone is complete at once; only a blend with a cone reads its depth. */
static Law law_line(double slope, double area, double bed_depth) {
    return (Law){.line_stiffness = slope,
                 .cone_depth = 1e-9,
                 .inverse_cone_depth = 1e9,
                 .bed_depth = bed_depth,
                 .bed_stiffness = LAW_BED_STRESS * area};
}

static Law law_cone(const MildMaterial *material, double pitch) {
    double area = pitch * pitch;
    double kappa = material->sigma_cone * area / cos(material->alpha);
    double c_g = material->c_g;
    double c_d = material->c_d;
    if (material->passive) { /* passive exactly when c_g >= 0 and c_d >= 1/2 */
        c_g = fmax(c_g, 0.0);
        c_d = fmax(c_d, 0.5);
    }
    Law law;
    law.flat_stiffness = material->k_pen - kappa;
    law.line_stiffness = kappa;
    law.cone_depth = pitch / sqrt(LAW_PI) * tan(material->alpha) / material->nu;
    law.inverse_cone_depth = 1.0 / law.cone_depth;
    law.mass_rate = c_g * material->phi * material->rho * material->nu * area;
    law.drag_rate = c_d * law.mass_rate;
    law.bed_depth = material->bed_depth;
    law.bed_stiffness = LAW_BED_STRESS * area;
    return law;
}

Law law_of(const MildMaterial *material, double pitch) {
    double area = pitch * pitch;
    if (material->model == MILD_MODEL_CON_SPRING || material->model == MILD_MODEL_ECC_SPRING) {
        return law_line(material->k_pen, area, material->bed_depth);
    }
    if (model_is_resistive(material->model)) {
        return law_line(material->zeta * LAW_RESIST_STRESS * area, area, material->bed_depth);
    }
    return law_cone(material, pitch);
}

int law_curves(const Law *law) {
    int cone = law->flat_stiffness != 0.0 || law->mass_rate != 0.0 || law->drag_rate != 0.0;
    return cone ? LAW_CONE : LAW_LINE;
}

MildElementLaw mild_element_law(const MildMaterial *material, double pitch, double depth) {
    Law law = law_of(material, pitch);
    int curves = law_curves(&law);
    return (MildElementLaw){
        .force = law_force(&law, curves, depth),
        .stiffness = law_slope(&law, curves, depth),
        .added_mass = law.mass_rate * law_recruited(&law, depth),
        .added_mass_per_depth = law.mass_rate * law_flat_share(&law, depth),
    };
}
