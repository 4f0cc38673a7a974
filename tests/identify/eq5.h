/* eq 5 for the tests of the fit. */
#ifndef EQ5_H
#define EQ5_H

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

#endif
