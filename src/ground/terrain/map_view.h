/* A map for the ground and the engine of many robots, in their scalar type, on a GPU too.
 *
 * Far from the map's origin a float cannot say where in a cell a point is. So a query has two
 * parts. A spot, once for a foot, is a whole number of cells and a rest, found without loss. Points
 * near it are a rest and a short way. What remains is the rounding of the numbers that come in: at
 * 50 m the coordinate of a foot is known to 1.9e-6 m. */
#ifndef MILD_GROUND_MAP_VIEW_H
#define MILD_GROUND_MAP_VIEW_H

#include <stddef.h>

#include "base/hd.h"
#include "mild/map.h"

/* ---- one cell of a grid ---- */

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

/* ---- the map ---- */

#ifdef MILD_REAL_FLOAT
#define REAL_FLOOR floorf
#define REAL_FMA fmaf
#else
#define REAL_FLOOR floor
#define REAL_FMA fma
#endif

#define MAP_FAR REAL(8388608) /* [cells] points farther away are as far as this */

/* A number as the sum of two floats, right to 2^-48 of it. */
typedef struct {
    float high;
    float low;
} MapNumber;

/* One axis of a grid. */
typedef struct {
    int cells;
    int repeats;       /* bool: otherwise the border extends outward */
    float start;       /* [cells] from where the grid begins to the map's origin, in whole halves */
    MapNumber cell;    /* [m] edge */
    MapNumber inverse; /* [1/m] */
} MapAxis;

typedef struct {
    const float *height;        /* [y.cells + 1][x.cells + 1] [m]; NULL: 0 everywhere */
    const unsigned char *label; /* [label_y.cells][label_x.cells]; NULL: 0 everywhere */
    MapAxis x;                  /* of the heights */
    MapAxis y;
    MapAxis label_x; /* of the labels */
    MapAxis label_y;
    MapNumber slope; /* [-] rise per metre along x, added to the heights */
    int labels;      /* they are 0 .. labels - 1 */
    int uneven;      /* bool: the height is not the same everywhere */
} MapView;

/* A view of a map on the CPU, without its labels, whose arrays are those of the map. */
MapView map_view(const MildMap *map);

MILD_HD Real map_number(MapNumber number) {
    return (Real)number.high + (Real)number.low;
}

/* Where a spot is along an axis. */
typedef struct {
    int cell;  /* as if the axis had no end */
    Real rest; /* [m] from the start of that cell */
} MapPlace;

typedef struct {
    MapPlace x;
    MapPlace y;
    MapPlace label_x;
    MapPlace label_y;
    Real plane; /* [m] height of the ground there, without that of the grid, above the point */
} MapSpot;

/* A whole number of cells within -MAP_FAR .. MAP_FAR, also of NaN. */
MILD_HD Real map_whole(Real cells) {
    return real_min(real_max(REAL_FLOOR(cells), -MAP_FAR), MAP_FAR);
}

/* at + more: [m] from the map's origin, `more` far smaller. With n the whole number of cells up to
 * it, the rest is at - n cell, of which fma rounds only the difference. */
MILD_HD MapPlace map_place(const MapAxis *axis, Real at, Real more) {
    const Real start = (Real)axis->start;
    const Real from = map_whole(at * (Real)axis->inverse.high + start);
    const Real cells = from - start;
    MapPlace place;
    place.cell = (int)from;
    place.rest =
        REAL_FMA(-cells, (Real)axis->cell.high, at) + (more - cells * (Real)axis->cell.low);
    return place;
}

/* The place on the grid that is `way` [m] from a spot. */
MILD_HD GridPlace map_near(const MapAxis *axis, const MapPlace *spot, Real way) {
    const Real cells = (spot->rest + way) * map_number(axis->inverse);
    const Real whole = map_whole(cells);
    const int cell = spot->cell + (int)whole;
    const Real share = cells - whole;
    GridPlace place;
    if (axis->repeats) {
        const int within = cell % axis->cells;
        place.cell = within < 0 ? within + axis->cells : within;
        place.share = share;
        place.inside = 1;
        return place;
    }
    const int before = cell < 0 || (cell == 0 && !(share > 0));
    const int beyond = cell >= axis->cells;
    place.cell = before ? 0 : beyond ? axis->cells - 1 : cell;
    place.share = before ? REAL(0) : beyond ? REAL(1) : share;
    place.inside = before || beyond ? REAL(0) : REAL(1);
    return place;
}

/* What the rounding of difference = a - b lost (Knuth). */
MILD_HD Real map_lost(Real a, Real b, Real difference) {
    const Real back = difference - a;
    return (a - (difference - back)) - (b + back);
}

/* The spot at a point [m] of the world, above which heights are counted. origin: [2] [m] of the
 * map; NULL: 0. height: [m] of the ground, without the map. */
MILD_HD MapSpot map_spot(const MapView *map, const Real point[3], const Real *origin, Real height) {
    const Real from_x = origin ? origin[0] : 0;
    const Real from_y = origin ? origin[1] : 0;
    const Real at_x = point[0] - from_x;
    const Real at_y = point[1] - from_y;
    const Real up = height - point[2];
    const Real more_x = map_lost(point[0], from_x, at_x);
    const Real more_y = map_lost(point[1], from_y, at_y);
    const Real more = map_lost(height, point[2], up);
    const Real steep = (Real)map->slope.high;
    MapSpot spot;
    spot.x = map_place(&map->x, at_x, more_x);
    spot.y = map_place(&map->y, at_y, more_y);
    spot.label_x = map_place(&map->label_x, at_x, more_x);
    spot.label_y = map_place(&map->label_y, at_y, more_y);
    spot.plane = REAL_FMA(steep, at_x, up) + (more + steep * more_x + (Real)map->slope.low * at_x);
    return spot;
}

/* Height [m] above a spot's point, and gradient [-], at (x, y) [m] from that point. */
MILD_HD Real map_surface_near(const MapView *map, const MapSpot *spot, Real x, Real y,
                              Real slope[2]) {
    const Real plane = spot->plane + map_number(map->slope) * x;
    slope[0] = map_number(map->slope);
    slope[1] = 0;
    if (!map->height) {
        return plane;
    }
    return cell_surface(map->height, map->x.cells, map_near(&map->x, &spot->x, x),
                        map_near(&map->y, &spot->y, y), map_number(map->x.inverse),
                        map_number(map->y.inverse), plane, slope);
}

/* Label there. */
MILD_HD int map_label_near(const MapView *map, const MapSpot *spot, Real x, Real y) {
    if (!map->label) {
        return 0;
    }
    const GridPlace a = map_near(&map->label_x, &spot->label_x, x);
    const GridPlace b = map_near(&map->label_y, &spot->label_y, y);
    return map->label[(size_t)b.cell * (size_t)map->label_x.cells + (size_t)a.cell];
}

#endif
