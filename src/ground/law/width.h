/* The width of a sole that Bekker's modulus k_c/b + k_phi, with a k_c below 0, allows. */
#ifndef MILD_GROUND_WIDTH_H
#define MILD_GROUND_WIDTH_H

#include "mild/ground.h"

/* [m] Least plate_width, given or of a sole, because Bekker's pressure grows with k_c/b. */
#define MATERIAL_PLATE_MIN 0.005

/* [m] The width below which there is no plate, or Bekker's modulus k_c/b + k_phi is below 0. */
static inline double plate_width_least(const MildMaterial *material) {
    const double least = -material->k_c / material->k_phi; /* NaN where both are 0 */
    return least > MATERIAL_PLATE_MIN ? least : MATERIAL_PLATE_MIN;
}

/* Where a material meets a sole whose shorter side is `width` [m]: fails where the modulus is below
 * 0, which the ground itself takes for 0. */
static inline MildStatus width_check(const MildMaterial *material, double width, MildError *error) {
    const double least = plate_width_least(material);
    const double b = material->plate_width > 0.0 ? material->plate_width : width;
    return material->model != MILD_MODEL_BEKKER || b >= least || least <= MATERIAL_PLATE_MIN
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_RANGE,
                           "ground.k_c = %g is too far below 0 for a sole of b = %g m: k_c/b + "
                           "k_phi is negative below b = %g m; set ground.plate_width to a width "
                           "above that, or k_c nearer to 0",
                           material->k_c, b, least);
}

#endif
