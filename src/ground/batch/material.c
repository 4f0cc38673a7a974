#include "ground/batch/material.h"

#include "ground/begin.h"
#include "ground/inside.h"

#define MATERIAL_LAW_INDEX(name) MATERIAL_LAW_##name,
enum { LAW_NUMBERS(MATERIAL_LAW_INDEX) MATERIAL_LAW_COUNT };
_Static_assert(MATERIAL_LAW_COUNT + 1 == MATERIAL_LAW_NUMBERS, "all numbers");

MildStatus material_numbers(const MildMaterial *material, double pitch, double width, int index,
                            MaterialNumbers *numbers, MildError *error) {
    MildError cause = {0};
    if (mild_material_check(material, &cause) != MILD_OK) {
        return mild_fail(error, MILD_ERROR_RANGE, "batch: material %d: %s", index, cause.text);
    }
    const InsideLaw inside = mild_inside_law(material, pitch, width);
    const Law law = inside.law;
    int n = 0;
#define MATERIAL_LAW_STORE(name) numbers->law[n++] = (float)law.name;
    LAW_NUMBERS(MATERIAL_LAW_STORE)
    numbers->law[n] = (float)law.cone_begin; /* 0: the place of an element in its sole says more */
    numbers->recovery = (float)inside.recovery;
    numbers->mu = (float)material->mu;
    numbers->k_drift = (float)inside.k_drift;
    numbers->b_drift = (float)inside.b_drift;
    numbers->exit_drag = (float)law_exit_drag(&law);
    numbers->entry_drag = (float)law_entry_drag(&law);
    numbers->cohesion = (float)material->cohesion;
    numbers->shear_length = (float)material->shear_length;
    numbers->projects = (float)inside.share.projects;
    numbers->slip_rate = (float)inside.share.slip_rate;
    numbers->regain_rate = (float)inside.share.regain_rate;
    numbers->grip = (float)inside.share.grip;
    numbers->growth = (float)inside.share.growth;
    numbers->side = (float)inside.share.side;
    numbers->curves = inside.curves;
    return MILD_OK;
}
