/* The table of the ground models. */
#ifndef MILD_GROUND_MODELS_H
#define MILD_GROUND_MODELS_H

#include "ground/model.h"

/* The row of a material's model. A model without a law, or an unknown one, gets the row of mild,
 * because the ground computes with materials that nobody has checked. */
const ModelRow *model_row(int model);
/* Law of one element of area pitch^2. */
Law law_of(const MildMaterial *material, double pitch);

#endif
