/* Resistive force theory under the elements (models ecc_quasi and ecc_quasi_3d). */
#ifndef MILD_GROUND_RESIST_H
#define MILD_GROUND_RESIST_H

#include "ground/contact.h"

static inline int model_is_resistive(int model) {
    return model == MILD_MODEL_ECC_QUASI || model == MILD_MODEL_ECC_QUASI_3D;
}

/* After slots_prepare: the law of the foot's resistive slots for the way they move at the start of
 * the step. rotation: of the foot; now: how it moves. */
void slots_resist(const FootScratch *foot, const MildTerrain *terrain, double dt,
                  const double *rotation, const Motion *now);

#endif
