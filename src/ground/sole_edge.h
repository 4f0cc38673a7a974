/* How far the elements of a plane sole are from the edge of its outline. */
#ifndef MILD_GROUND_SOLE_EDGE_H
#define MILD_GROUND_SOLE_EDGE_H

#include "ground/sole.h"

/* Bool: the point is inside the outline. */
int outline_inside(const MildSoleDef *def, double x, double y);
/* Fills SOLE_EDGE and SOLE_SPREAD of a sole with centres. Cells cover more or less than the outline,
 * and each counts whole: so the distances are scaled to the mean over the outline. area: of the
 * outline [m^2]. low, high: its box [m]. work: [points] scratch space. */
void sole_edges(MildSole *sole, const MildSoleDef *def, double area, const double *low,
                const double *high, int *work);

#endif
