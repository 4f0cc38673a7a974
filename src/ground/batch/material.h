/* A material as a batch keeps it: the numbers of ContactMaterial, in float whatever Real is. The
 * laws are derived in double. */
#ifndef MILD_BATCH_MATERIAL_H
#define MILD_BATCH_MATERIAL_H

#include "mild/ground.h"

#define MATERIAL_LAW_NUMBERS 14

typedef struct {
    float law[MATERIAL_LAW_NUMBERS];                             /* in the order of Law */
    float recovery, mu, k_drift, b_drift, exit_drag, entry_drag; /* as in ContactMaterial */
    float cohesion, shear_length;
    float projects, slip_rate, regain_rate, grip, growth, side;
    int curves;
} MaterialNumbers;

/* [count + 1][soles] of materials [count] under soles of these pitches and widths [soles] [m]
 * (mild_sole_width), in the memory of a device; the last is not a number. Adds the LawCurve bits of
 * all to *curves. NULL when a material is refused by mild_material_check or by the width of a sole,
 * or when out of memory. */
MaterialNumbers *material_table(int device, const double *pitch, const double *width, int soles,
                                const MildMaterial *materials, int count, int *curves,
                                MildError *error);

#endif
