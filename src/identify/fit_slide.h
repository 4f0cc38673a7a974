/* The rows of a fit of a plate that slides (fit_drag.h), from those of its record. Pure functions:
 * thread safe. */
#ifndef LAB_FIT_SLIDE_H
#define LAB_FIT_SLIDE_H

#include "identify/fit_law.h"

/* The rows of a fit, rows[2 * count], from those that fit_sliding found on a plate. curve: the
 * force that a press of the ground has. Returns their number; 0 where nothing pushes up. */
int fit_slide_rows(const FitPlate *plate, const MildMaterial *curve, const FitPoint *slide,
                   int count, FitPoint *rows);

/* The ground that a fit of FIT_DRAG starts from: the press's numbers where the press determines
 * them, else `known`'s. press: NULL: none was fitted. */
MildMaterial fit_slide_base(const MildMaterial *known, const MildMaterial *press);

#endif
