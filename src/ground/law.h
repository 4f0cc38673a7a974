/* The developing cone of one element (paper eqs 1-5, read as in docs: stiffness per element area,
 * added mass positive, flat area frozen at zero once the cone is complete).
 *
 * With t = min(u/u_f, 1), u_f = R tan(alpha)/nu and s = pi R^2 the element's area, the flat area is
 * S_flat = s (1 - t)^2 and I_flat = integral S_flat = s P(u),   P = u_f (t - t^2 + t^3/3) = u_f/3
 * (1 - (1 - t)^3) I_cone = (s u - I_flat)/cos(alpha) so that, with kappa = sigma_cone s/cos(alpha),
 *     F_g = (k_pen - kappa) P + kappa u      K = (k_pen - kappa) (1 - t)^2 + kappa
 *     m_a = c_g phi rho nu s P               m_a' = c_g phi rho nu s (1 - t)^2
 * Nothing cancels at small u or small nu/tan(alpha), because u_f is the only length left. F_g is
 * concave when k_pen > kappa, convex otherwise, and straight past u_f.
 *
 * The rival models are the same law with other numbers: a yielding spring is kappa = k_pen without
 * a flat part, resistive force theory kappa = zeta 1e6 s (its orientation dependence: resist.h);
 * neither has inertia. */
#ifndef MILD_GROUND_LAW_H
#define MILD_GROUND_LAW_H

#include <math.h>

#include "mild/ground.h"

#define LAW_PI 3.14159265358979323846
#define LAW_BED_STRESS                                                                             \
    5e7 /* [N/m^3] stiffness of the firm bed per area: 0.4 mm more for a robot on ten elements */

typedef struct {
    double flat;          /* [N/m] k_pen - kappa */
    double cone;          /* [N/m] kappa, the slope once the cone is complete */
    double full;          /* [m] u_f */
    double inverse_full;  /* [1/m] */
    double mass;          /* [kg/m] c_g phi rho nu s */
    double drag;          /* [kg/m] c_d c_g phi rho nu s */
    double bed;           /* [m] */
    double bed_stiffness; /* [N/m] */
} Law;

#define LAW_RESIST_STRESS                                                                          \
    1e6 /* [N/m^3] of a level plate going straight down at zeta = 1 (Li et al. 2013) */

/* F_g = slope u: the cone is complete at once. */
static inline Law law_straight(double slope, double area, double bed) {
    return (Law){.cone = slope,
                 .full = 1e-9,
                 .inverse_full = 1e9,
                 .bed = bed,
                 .bed_stiffness = LAW_BED_STRESS * area};
}

static inline Law law_of(const MildMaterial *material, double pitch) {
    double area = pitch * pitch;
    if (material->model == MILD_MODEL_CON_SPRING || material->model == MILD_MODEL_ECC_SPRING) {
        return law_straight(material->k_pen, area, material->bed_depth);
    }
    if (material->model == MILD_MODEL_ECC_QUASI || material->model == MILD_MODEL_ECC_QUASI_3D) {
        return law_straight(material->zeta * LAW_RESIST_STRESS * area, area, material->bed_depth);
    }
    double kappa = material->sigma_cone * area / cos(material->alpha);
    double c_g = material->c_g, c_d = material->c_d;
    if (material->passive) { /* passive exactly when c_g >= 0 and c_d >= 1/2 */
        c_g = fmax(c_g, 0.0);
        c_d = fmax(c_d, 0.5);
    }
    Law law;
    law.flat = material->k_pen - kappa;
    law.cone = kappa;
    law.full = pitch / sqrt(LAW_PI) * tan(material->alpha) / material->nu;
    law.inverse_full = 1.0 / law.full;
    law.mass = c_g * material->phi * material->rho * material->nu * area;
    law.drag = c_d * law.mass;
    law.bed = material->bed_depth;
    law.bed_stiffness = LAW_BED_STRESS * area;
    return law;
}

#endif
