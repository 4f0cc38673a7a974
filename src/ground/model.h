/* A ground model: what its file, model_NAME.c, says of it. Its row is in MILD_MODEL_LIST
 * (mild/ground.h).
 *
 * A model made of curves that law.h has is that file and that row. A model with a new curve adds
 * the curve there first. */
#ifndef MILD_GROUND_MODEL_H
#define MILD_GROUND_MODEL_H

#include "ground/element_law.h"
#include "ground/motion.h"

struct FootScratch;

typedef struct {
    MildModelInfo info;

    /* Law of one element of area pitch^2. NULL: the model has no soft ground. */
    Law (*law)(const MildMaterial *material, double pitch);

    /* Turns a material of mild into one of this model, as far as it differs, before its `scaled`
     * fields are multiplied so that it sinks as deep. Of these only the ratios matter. area: of the
     * model's element [m^2]. NULL: nothing differs. */
    void (*reference)(MildMaterial *material, double area);

    /* Once per step, after element_begin: changes the law of the foot's slots that stand on `model`
     * for the way they move at the start of the step. rotation: of the foot. NULL: the law knows no
     * direction. */
    void (*direction)(const struct FootScratch *foot, const MildTerrain *terrain, int model,
                      double dt, const double *rotation, const Motion *now);
} ModelRow;

#endif
