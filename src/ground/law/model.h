/* What a ground model's file, models/model_*.c, must provide. The model also has a row in
 * MILD_MODEL_LIST (mild/ground.h).
 *
 * A model made of the curves of law.h needs nothing but that file and that row. A model with a new
 * curve adds the curve to law.h first. */
#ifndef MILD_GROUND_MODEL_H
#define MILD_GROUND_MODEL_H

#include "ground/law/element_law.h"
#include "ground/law/motion.h"

struct FootScratch;

typedef struct {
    MildModelInfo info;

    /* Law of one element of area pitch^2. NULL: the model has no soft ground. */
    Law (*law)(const MildMaterial *material, double pitch);

    /* Bool: the cones of one sole merge: an element's place in the sole gives its law, and it
     * presses with its projected area (share.h). */
    int merged;
    /* Bool: slip takes the support away where the material has a slip_length. */
    int slips;

    /* Used by mild_model_match: changes a material of mild or mild_merged into one of this model,
     * where the two differ. The `scaled` fields are then multiplied by a factor that gives the same
     * sinkage, so only their ratios matter here. area: [m^2] of an element of the model. NULL:
     * nothing differs. */
    void (*reference)(MildMaterial *material, double area);

    /* LawMotion bit of `direction`, whose formulas src/ground/batch has too (contact_direct). 0:
     * NULL. */
    int motion;

    /* Called once per step after element_begin. Adapts the law or the friction of the foot's slots
     * that stand on `model` to their motion, at the start of the step or so far. rotation: of the
     * foot. NULL: neither depends on the motion. */
    void (*direction)(const struct FootScratch *foot, const MildTerrain *terrain, int model,
                      double dt, const double *rotation, const Motion *now);

    /* Changes *material, which is the default on entry, into the preset `name`, one of
     * info.presets. Returns false when the name is unknown. NULL: the model has no presets. */
    int (*preset)(const char *name, MildMaterial *material);
} ModelRow;

#endif
