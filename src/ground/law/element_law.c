#define POWER_FN /* here lie the functions that files with POWER_CALLED call: power.h */
#include "ground/law/element_law.h"

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
    if (material->passive) { /* the law is passive if and only if c_g >= 0 and c_d >= 1/2 */
        c_g = fmax(c_g, 0.0);
        c_d = fmax(c_d, 0.5);
    }
    Law law = {0}; /* the other curves are absent */
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
    const int cone = law->flat_stiffness != 0.0 || law->mass_rate != 0.0 || law->drag_rate != 0.0;
    return (cone ? LAW_CONE : 0) | (law->power_force != 0.0 ? LAW_POWER : 0) |
           (law->elastic_force != 0.0 ? LAW_ELASTIC : 0);
}

#define LAW_INDEX(name) LAW_INDEX_##name,
enum { LAW_NUMBERS(LAW_INDEX) LAW_COUNT };
_Static_assert(sizeof(Law) == (LAW_COUNT + 1) * sizeof(Real),
               "LAW_NUMBERS lists every field of Law but cone_begin");

#define LAW_ADD(name) sum += law->name;
int law_is_nan(const Law *law) {
    double sum = 0.0;
    LAW_NUMBERS(LAW_ADD)
    return isnan(sum); /* not isfinite: the bed may be at infinity */
}

double law_recovery(const Law *law, double recovery) {
    return law->elastic_force != 0.0 ? 1.0 : recovery;
}

static double between(double a, double b, double share) {
    return a + share * (b - a);
}

/* Interpolates a number of a curve. If only one of the laws has the curve, its number is kept and
 * only its force fades out. */
static double between_curves(double force_a, double a, double force_b, double b, double share) {
    if (force_a == 0.0) {
        return b;
    }
    return force_b == 0.0 ? a : between(a, b, share);
}

#define LAW_BETWEEN(name) .name = between(a->name, b->name, share),
Law law_between(const Law *a, const Law *b, double share) {
    Law law = {LAW_NUMBERS(LAW_BETWEEN)};
    law.inverse_cone_depth = 1.0 / law.cone_depth;
    law.cone_begin = between(a->cone_begin, b->cone_begin, share);
    law.power_exponent =
        between_curves(a->power_force, a->power_exponent, b->power_force, b->power_exponent, share);
    law.elastic_exponent = between_curves(a->elastic_force, a->elastic_exponent, b->elastic_force,
                                          b->elastic_exponent, share);
    law.elastic_damping = between_curves(a->elastic_force, a->elastic_damping, b->elastic_force,
                                         b->elastic_damping, share);
    return law;
}
