/* The surface of a map in one cell of its grid: one code for the ground of the CPU and of a GPU. */
#ifndef MILD_GROUND_SURFACE_H
#define MILD_GROUND_SURFACE_H

#include <stddef.h>

#include "base/hd.h"

/* Position on a grid along one axis. */
typedef struct {
    int cell;    /* index of the cell */
    Real share;  /* [-] position in the cell, 0 .. 1 */
    Real inside; /* 1 within the grid, 0 beyond its border */
} GridPlace;

/* Height [m] and gradient [-] at a place of a grid, by bilinear interpolation. With s and t the
 * position in the cell along x and y, from 0 to 1:
 *
 *     h = (1 - t) ((1 - s) h00 + s h10) + t ((1 - s) h01 + s h11)
 *
 * height: [rows + 1][columns + 1] [m]. inverse: [1/m] of the edges of a cell. plane: [m] added to
 * the height. slope: in, the plane's. */
MILD_HD Real cell_surface(const float *height, int columns, GridPlace a, GridPlace b,
                          Real inverse_x, Real inverse_y, Real plane, Real slope[2]) {
    const size_t stride = (size_t)columns + 1;
    const float *at = height + (size_t)b.cell * stride + (size_t)a.cell;
    const Real h00 = (Real)at[0];
    const Real h10 = (Real)at[1];
    const Real h01 = (Real)at[stride];
    const Real h11 = (Real)at[stride + 1];
    const Real low = h00 + a.share * (h10 - h00);
    const Real high = h01 + a.share * (h11 - h01);
    slope[0] += a.inside * inverse_x * ((h10 - h00) + b.share * ((h11 - h01) - (h10 - h00)));
    slope[1] += b.inside * inverse_y * (high - low);
    return plane + low + b.share * (high - low);
}

#endif
