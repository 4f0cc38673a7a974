/* What the tests of the fit share: eq 5, a fit that succeeds, a value of it by name. */
#ifndef FIT_KIT_H
#define FIT_KIT_H

#include "identify/fit.h"
#include "kit.h"

/* [N] On the plate of a row, by the library's public law. */
static inline double force_of(const FitDef *def, const FitPoint *row) {
    const FitPlate *plate = &def->plate[row->plate];
    MildMaterial m = def->material;
    m.plate_width = plate->width;
    const MildElementLaw law = mild_element_law(&m, plate->pitch, row->depth);
    const double drag = fmax(m.c_d, 0.5) * law.added_mass_per_depth * row->speed * row->speed;
    return plate->elements *
           (law.force + law.damping * row->speed + drag + law.added_mass * row->acceleration);
}

static inline FitResult fit_of(const FitDef *def, const FitPoint *points, int count) {
    FitResult result;
    MildError error = {0};
    expect_good(fit_run(def, points, count, &result, &error) == MILD_OK, &error);
    return result;
}

static inline FitValue *value_of(FitResult *result, const char *name) {
    for (int i = 0; i < result->parameters; i++) {
        if (strcmp(result->parameter[i].name, name) == 0) {
            return &result->parameter[i];
        }
    }
    for (int i = 0; i < result->combinations; i++) {
        if (strcmp(result->combination[i].name, name) == 0) {
            return &result->combination[i];
        }
    }
    fail_msg("no %s", name);
    return NULL;
}

#endif
