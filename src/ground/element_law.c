#include "ground/element_law.h"

Law law_line(double slope, double area, double bed_depth) {
    return (Law){.line_stiffness = slope,
                 .cone_depth = LAW_LINE_DEPTH,
                 .inverse_cone_depth = 1.0 / LAW_LINE_DEPTH,
                 .bed_depth = bed_depth,
                 .bed_stiffness = LAW_BED_STRESS * area};
}

Law law_spring(const MildMaterial *material, double pitch) {
    return law_line(material->k_pen, pitch * pitch, material->bed_depth);
}

void law_spring_material(MildMaterial *material, double area) {
    (void)area;
    material->k_pen = 1.0;
    material->recovery = 0.0;
}

Law law_cone(const MildMaterial *material, double pitch) {
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

int law_curves(const Law *law) {
    int cone = law->flat_stiffness != 0.0 || law->mass_rate != 0.0 || law->drag_rate != 0.0;
    return cone ? LAW_CONE : LAW_LINE;
}
