/* The inside of a map: two regular grids. One has heights at its points, the other has labels in
 * its cells. */
#ifndef MILD_GROUND_GRID_H
#define MILD_GROUND_GRID_H

#include <math.h>

#include "ground/terrain/map_view.h"
#include "mild/map.h"

/* Cell (0, 0) begins at (x0, y0), a whole number of half cells from the map's origin. */
typedef struct {
    int columns;      /* cells along x */
    int rows;         /* cells along y */
    int repeats;      /* bool: the grid is periodic; otherwise its border values extend outward */
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

/* at: coordinate from the start of the grid, in cells. Any number gives a valid cell, because the
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

/* Material of a cell, which is a mixture of two near a smooth border. */
typedef struct {
    unsigned char first;  /* label of the nearer material */
    unsigned char second; /* label of the other material */
    unsigned char share;  /* of the second material, in 1/255 */
} Label;

struct MildMap {
    Grid heights;    /* grid of `height` */
    Grid labels;     /* grid of `label` */
    double slope;    /* [-] rise per metre along x, added to the heights of the grid */
    double steepest; /* [-] upper bound on the length of the gradient */
    double low;      /* [m] lowest height of the grid */
    double high;     /* [m] highest height of the grid */
    float *height;   /* [rows + 1][columns + 1] [m]; NULL: 0 everywhere */
    Label *label;    /* [rows][columns]; NULL: 0 everywhere */
    int label_count; /* labels are 0 .. label_count - 1 */
    size_t bytes;    /* memory of the map */
};

/* ---- what fills a map: pattern.c and shape.c ---- */

/* Fills the map's labels, label and label_count from `def`. Fails when an image is missing, when
 * numbers contradict each other, when there are too many cells, or when out of memory. */
MildStatus pattern_fill(MildMap *map, const MildMapDef *def, MildError *error);

/* Fills the map's heights, height and slope from `def`. Fails when an image is missing or contains
 * an unusable value, when there are too many points, or when out of memory. */
MildStatus shape_fill(MildMap *map, const MildMapDef *def, MildError *error);

/* ---- what a terrain asks of its map: map.c ---- */

/* Height [m] and gradient [-] at a point of the map. */
double map_surface(const MildMap *map, double x, double y, double slope[2]);
/* Label at a point of the map. */
Label map_label(const MildMap *map, double x, double y);

#endif
