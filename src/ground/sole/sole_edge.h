/* How far the cells of a plane raster are from the edge of the outline. */
#ifndef MILD_GROUND_SOLE_EDGE_H
#define MILD_GROUND_SOLE_EDGE_H

#include "mild/ground.h"

typedef struct {
    double area;            /* [m^2] of the outline */
    double low[2], high[2]; /* [m] its box */
} EdgeBox;

/* Bool: the point is inside the outline. */
int outline_inside(const MildSoleDef *def, double x, double y);
/* Mean and standard deviation of that distance over the n cells about (x, y) [m]. Cells cover more
 * or less than the outline, and each counts whole: so the distances are scaled to the mean over the
 * outline. work: [points] scratch space. */
void sole_edges(const MildSoleDef *def, const EdgeBox *box, int n, const double *x, const double *y,
                double *edge, double *spread, int *work);

#endif
