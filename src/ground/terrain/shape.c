/* The heights at the grid points follow the formulas of MildMapKind (mild/map.h). For a shape that
 * repeats, the grid holds one period. */
#include "ground/terrain/grid.h"

#include <stdlib.h>

#define TWO_PI 6.283185307179586
#define TILE_EDGE_MIN 2.0 /* [m] so that a tile has more than what fades */
#define TILE_FADE 0.5     /* [m] width within a tile's edge over which its relief fades out */

typedef double (*ShapeHeight)(const MildMapDef *def, double x, double y);

static double height_steps(const MildMapDef *def, double x, double y) {
    (void)y;
    double phase = x / def->wavelength - 0.25;
    return phase - floor(phase) < 0.5 ? def->amplitude : 0.0;
}

static double height_waves(const MildMapDef *def, double x, double y) {
    double k = TWO_PI / def->wavelength;
    return 0.5 * def->amplitude * (sin(k * x) + sin(k * y));
}

/* Random height in [-1, 1) of a lattice point: SplitMix64 of the seed and the point. */
static double lattice_height(uint64_t seed, int i, int j) {
    uint64_t x = seed + 0x9e3779b97f4a7c15u * (((uint64_t)(uint32_t)i << 32) + (uint32_t)j + 1u);
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    x ^= x >> 31;
    return 2.0 * ((double)(x >> 11) * 0x1.0p-53) - 1.0;
}

/* Smooth step from 0 to 1, level at both ends. */
static double smooth(double t) {
    return t * t * (3.0 - 2.0 * t);
}

static double height_rough(const MildMapDef *def, double x, double y) {
    int points = (int)fmax(1.0, round(def->size / def->wavelength));
    GridPlace a = grid_place(x / def->size * points, points, 1);
    GridPlace b = grid_place(y / def->size * points, points, 1);
    int i1 = (a.cell + 1) % points;
    int j1 = (b.cell + 1) % points;
    double s = smooth(a.share);
    double t = smooth(b.share);
    double low = (1.0 - s) * lattice_height(def->seed, a.cell, b.cell) +
                 s * lattice_height(def->seed, i1, b.cell);
    double high =
        (1.0 - s) * lattice_height(def->seed, a.cell, j1) + s * lattice_height(def->seed, i1, j1);
    return def->amplitude * ((1.0 - t) * low + t * high);
}

/* One tile of mixed ground with its own relief. z: random number in [-1, 1).
 * share = 1/4 + 3/4 |z|, d: distance to the tile's edge, f = smooth(d/TILE_FADE) up to 1.
 * pyramid: sign(z) share slope d; waves, steps, rough: share f height of that kind. */
static double height_mixed(const MildMapDef *def, double x, double y) {
    const double edge = def->size / MILD_MAP_TILES;
    const GridPlace a = grid_place(x / edge, MILD_MAP_TILES, 1);
    const GridPlace b = grid_place(y / edge, MILD_MAP_TILES, 1);
    const double d = edge * (0.5 - fmax(fabs(a.share - 0.5), fabs(b.share - 0.5)));

    /* Rough ground uses the random numbers of points from 0 up, so tiles use those below. */
    const int tile = -1 - (b.cell * MILD_MAP_TILES + a.cell);
    const double relief = 8.0 * (1.0 + lattice_height(def->seed, tile, 0)); /* [0, 16) */
    const double z = lattice_height(def->seed, tile, 1);
    const double share = 0.25 + 0.75 * fabs(z);
    const double faded = share * smooth(fmin(d / TILE_FADE, 1.0));
    if (relief < 4.0) {
        return 0.0;
    }
    if (relief < 7.0) {
        return copysign(share, z) * def->slope * d;
    }
    if (relief < 10.0) {
        return faded * height_waves(def, x, y);
    }
    return faded * (relief < 13.0 ? height_steps(def, x, y) : height_rough(def, x, y));
}

/* Block k of n has its middle at k size/n; from the last one on x is negative. */
static double height_blocks(const MildMapDef *def, double x, double y) {
    const int blocks = (int)fmax(1.0, round(def->size / def->wavelength));
    const int i = grid_place(x / def->size * blocks + 0.5, blocks, 1).cell;
    const int j = grid_place(y / def->size * blocks + 0.5, blocks, 1).cell;
    const double from = (i < blocks - i ? i : blocks - i) * def->size / blocks;
    const double bound = def->slope == 0.0 ? def->amplitude : fabs(def->slope) * from;
    const double level = floor(1.5 * (1.0 + lattice_height(def->seed, i, j))); /* 0, 1 or 2 */
    return 0.5 * fmin(bound, def->amplitude) * level;
}

static MildStatus shape_allocate(MildMap *map, double columns, double rows, double cell_x,
                                 double cell_y, int repeats, MildError *error) {
    if ((columns + 1.0) * (rows + 1.0) > MILD_MAP_POINTS_MAX) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "terrain.cell = %g makes %g x %g points, more than %d: use larger cells",
                         cell_x, columns + 1.0, rows + 1.0, MILD_MAP_POINTS_MAX);
    }
    map->heights = grid_make((int)columns, (int)rows, cell_x, cell_y, repeats);
    map->height = malloc((size_t)((columns + 1.0) * (rows + 1.0)) * sizeof *map->height);
    return map->height ? MILD_OK : mild_fail(error, MILD_ERROR_MEMORY, "terrain: out of memory");
}

/* Fills the grid with one period of a formula. The cells are adjusted so that a whole number of
 * them fits. The last points repeat the first. */
static MildStatus shape_formula(MildMap *map, const MildMapDef *def, double period, int along_y,
                                ShapeHeight height, MildError *error) {
    double columns = ceil(period / def->cell - 1e-9);
    double rows = along_y ? columns : 1.0;
    double cell = period / columns;
    MildStatus status = shape_allocate(map, columns, rows, cell, cell, 1, error);
    if (status != MILD_OK) {
        return status;
    }
    const Grid *grid = &map->heights;
    for (int j = 0; j <= grid->rows; j++) {
        for (int i = 0; i <= grid->columns; i++) {
            map->height[(size_t)j * ((size_t)grid->columns + 1) + (size_t)i] =
                (float)height(def, (i % grid->columns) * cell, (j % grid->rows) * cell);
        }
    }
    return MILD_OK;
}

/* The cells divide a tile evenly, so that the edges of tiles lie on grid points. */
static MildStatus shape_mixed(MildMap *map, const MildMapDef *def, MildError *error) {
    const double edge = def->size / MILD_MAP_TILES;
    if (edge < TILE_EDGE_MIN) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "terrain.size = %g makes tiles of %g m, which is too small for "
                         "terrain.kind = mixed: use at least %g",
                         def->size, edge, MILD_MAP_TILES * TILE_EDGE_MIN);
    }
    MildMapDef even = *def;
    even.cell = edge / ceil(edge / def->cell - 1e-9);
    return shape_formula(map, &even, def->size, 1, height_mixed, error);
}

static MildStatus shape_image(MildMap *map, const MildMapDef *def, MildError *error) {
    int columns = def->height_columns, rows = def->height_rows;
    if (!def->heights || columns < 2 || rows < 2) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "terrain.kind = image needs an image of at least 2 x 2 heights "
                         "(terrain.image), got %d x %d",
                         def->heights ? columns : 0, def->heights ? rows : 0);
    }
    MildStatus status =
        shape_allocate(map, columns - 1.0, rows - 1.0, def->cell, def->cell, 0, error);
    if (status != MILD_OK) {
        return status;
    }
    map->heights.x0 = -0.5 * (columns - 1) * def->cell;
    map->heights.y0 = -0.5 * (rows - 1) * def->cell;
    for (int j = 0; j < rows; j++) {
        for (int i = 0; i < columns; i++) {
            double height =
                def->amplitude * def->heights[(size_t)(rows - 1 - j) * (size_t)columns + (size_t)i];
            if (!isfinite(height) || fabs(height) > 1e3) {
                return mild_fail(error, MILD_ERROR_RANGE,
                                 "terrain.image: height %g at row %d, column %d is not usable",
                                 height, rows - 1 - j, i);
            }
            map->height[(size_t)j * (size_t)columns + (size_t)i] = (float)height;
        }
    }
    return MILD_OK;
}

MildStatus shape_fill(MildMap *map, const MildMapDef *def, MildError *error) {
    switch ((MildMapKind)def->kind) {
    case MILD_MAP_FLAT: break;
    case MILD_MAP_SLOPE: map->slope = def->slope; break;
    case MILD_MAP_STEPS: return shape_formula(map, def, def->wavelength, 0, height_steps, error);
    case MILD_MAP_WAVES: return shape_formula(map, def, def->wavelength, 1, height_waves, error);
    case MILD_MAP_ROUGH: return shape_formula(map, def, def->size, 1, height_rough, error);
    case MILD_MAP_IMAGE: return shape_image(map, def, error);
    case MILD_MAP_MIXED: return shape_mixed(map, def, error);
    case MILD_MAP_BLOCKS: return shape_formula(map, def, def->size, 1, height_blocks, error);
    }
    return MILD_OK;
}
