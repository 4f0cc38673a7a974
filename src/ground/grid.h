/* Inside of a map: two regular grids, one of heights at its points and one of labels in its
 * cells. */
#ifndef MILD_GROUND_GRID_H
#define MILD_GROUND_GRID_H

#include <math.h>

#include "mild/map.h"

/* Cell (0, 0) begins at (x0, y0). */
typedef struct {
    int columns;      /* cells along x */
    int rows;         /* cells along y */
    int repeats;      /* bool: the first cell follows the last; otherwise the border goes on */
    double x0;        /* [m] */
    double y0;        /* [m] */
    double cell_x;    /* [m] edges of a cell */
    double cell_y;    /* [m] */
    double inverse_x; /* [1/m] 1/cell_x */
    double inverse_y; /* [1/m] 1/cell_y */
} Grid;

static inline Grid grid_make(int columns, int rows, double cell_x, double cell_y, int repeats) {
    return (Grid){columns, rows, repeats, 0.0, 0.0, cell_x, cell_y, 1.0 / cell_x, 1.0 / cell_y};
}

/* Where one coordinate lies on a grid. */
typedef struct {
    int cell;      /* index of the cell */
    double share;  /* [-] of the way through the cell */
    double inside; /* 1 within the grid, 0 beyond its border */
} GridPlace;

/* at: coordinate from the start of the grid, in cells. Any number gives a valid cell: the
 * comparisons are false for NaN. */
static inline GridPlace grid_place(double at, int cells, int repeats) {
    double end = (double)cells;
    if (repeats) {
        at -= end * floor(at / end);
    }
    double clamped = at > 0.0 ? (at < end ? at : end) : 0.0;
    int cell = (int)clamped;
    if (cell >= cells) {
        cell = cells - 1;
    }
    return (GridPlace){cell, clamped - (double)cell, repeats || (at > 0.0 && at < end) ? 1.0 : 0.0};
}

/* Material of a cell: near a smooth border a mixture of two. */
typedef struct {
    unsigned char first;  /* label of the nearer material */
    unsigned char second; /* label of the other one */
    unsigned char share;  /* of the second; 255 is all of it */
} Label;

struct MildMap {
    Grid heights;    /* of the points' heights */
    Grid labels;     /* of the cells' labels */
    double slope;    /* [-] rise per metre along x, added to the grid */
    double steepest; /* [-] a bound of the gradient's length */
    double low;      /* [m] lowest height of the grid */
    double high;     /* [m] highest */
    float *height;   /* [rows + 1][columns + 1] [m]; NULL: 0 everywhere */
    Label *label;    /* [rows][columns]; NULL: 0 everywhere */
    int label_count; /* labels are 0 .. label_count - 1 */
    size_t bytes;    /* of the map */
};

#endif
