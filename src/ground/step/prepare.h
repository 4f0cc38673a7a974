/* First stage of a contact step: lists the elements that may touch and fixes the law of each. */
#ifndef MILD_GROUND_PREPARE_H
#define MILD_GROUND_PREPARE_H

#include "ground/step/scratch.h"

/* Lists the elements and sets the law of every slot for this step. Returns how many elements may
 * touch. */
int contact_prepare(const MildGround *ground, const MildTerrain *terrain,
                    const MildContactInput *input, MildScratch *scratch);

#endif
