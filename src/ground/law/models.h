/* The table of the ground models. */
#ifndef MILD_GROUND_MODELS_H
#define MILD_GROUND_MODELS_H

#include "ground/law/model.h"
#include "ground/law/share.h"
#include "ground/law/width.h"

/* The row of a material's model. Returns the row of mild for an unknown model and for one without a
 * law, because the ground must survive unchecked materials. */
const ModelRow *model_row(int model);
/* Bool: mild or mild_merged, whose materials mild_model_match takes. */
int model_is_cones(int model);
/* The same ground under elements of that pitch (docs/model.md section 16). The numbers of a
 * concentric model belong to the whole sole, and stay. */
MildMaterial material_at(const MildMaterial *material, double pitch);
/* Law of one element of area pitch^2 of a sole whose shorter side is `width`. */
Law law_of(const MildMaterial *material, double pitch, double width);
/* LawCurve bits of a material whose law is `law`. */
int curves_of(const MildMaterial *material, const Law *law);
/* The share of its load that the ground carries (share.h): the material's numbers, under an element
 * as for law_of. width: 0 for a shell. The rest is 0. */
Share share_of(const MildMaterial *material, double pitch, double width);
/* [-] Share of the depth that its virgin ground springs back: the material's, but 0 in resistive
 * force theory, whose unloading line has no other length (plate.h). */
double recovery_of(const MildMaterial *material);

#endif
