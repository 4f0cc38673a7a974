/* A map inside: two regular grids, of heights at the points and of labels in the cells. */
#ifndef MILD_GROUND_MAP_H
#define MILD_GROUND_MAP_H

#include <math.h>

#include "mild/map.h"

/* Cells along x and y; cell (0, 0) begins at (x0, y0). */
typedef struct {
    int columns, rows;
    int repeats; /* bool: beyond the last cell comes the first again; otherwise the border goes on
                  */
    double x0, y0, cell_x, cell_y; /* [m] */
    double inverse_x, inverse_y;   /* [1/m] */
} Grid;

static inline Grid grid_make(int columns, int rows, double cell_x, double cell_y, int repeats) {
    return (Grid){columns, rows, repeats, 0.0, 0.0, cell_x, cell_y, 1.0 / cell_x, 1.0 / cell_y};
}

/* One coordinate: the cell it lies in, the share of the way through it, and 1 within the grid, 0
 * beyond its border. */
typedef struct {
    int cell;
    double share, inside;
} GridPlace;

/* at: [cells] from the grid's begin. The comparisons are false for NaN, so that any number gives a
 * valid cell. */
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

typedef struct {
    unsigned char first, second, share; /* share of the second: 255 is all of it */
} Label;

struct MildMap {
    Grid heights, labels;
    double slope;     /* [-] rise per metre along x, on top of the grid */
    double steepest;  /* [-] bound of the gradient's length */
    double low, high; /* [m] of the grid */
    float *height;    /* [rows + 1][columns + 1] [m]; NULL: level */
    Label *label;     /* [rows][columns]; NULL: 0 everywhere */
    int label_count;
    size_t bytes;
};

/* Height and slope of the plane and the grid. */
double map_surface(const MildMap *map, double x, double y, double slope[2]);
Label map_label(const MildMap *map, double x, double y);

/* Fill map->heights and map->height (shape.c), map->labels and map->label (pattern.c) as `def`
 * says. */
MildStatus shape_fill(MildMap *map, const MildMapDef *def, MildError *error);
MildStatus pattern_fill(MildMap *map, const MildMapDef *def, MildError *error);

#endif
