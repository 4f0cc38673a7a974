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

/* Under an element of area pitch^2 of a sole whose shorter side is `width`. Fails for a material
 * that mild_material_check refuses. index: of the material, for the message. */
MildStatus material_numbers(const MildMaterial *material, double pitch, double width, int index,
                            MaterialNumbers *numbers, MildError *error);

#endif
