#include "ground/terrain/grid.h"

#include <stdlib.h>

#include "base/float.h"
#include "ground/terrain/map_view.h"

#define FIELD(member, low, high, help)                                                             \
    MILD_FIELD(MildMapDef, member, MILD_FIELD_DOUBLE, 1, low, high, help)
#define COUNT(names) ((int)(sizeof(names) / sizeof *(names)))
#define KIND(id, name) #name,
static const char *const kinds[] = {MILD_MAP_LIST(KIND)};
static const char *const patterns[] = {"none", "stripes", "checker", "image"};
const MildField mild_map_fields[] = {
    MILD_FIELD_CHOICE(MildMapDef, kind, kinds, COUNT(kinds), "[-] shape of the surface"),
    FIELD(cell, 0.001, 1.0, "[m] spacing of the height grid; with kind = image, of the pixels"),
    FIELD(size, 0.1, 1000.0,
          "[m] rough, mixed, blocks: period after which the heights repeat; mixed: at least 10"),
    FIELD(amplitude, 0.0, 5.0,
          "[m] waves, rough: largest height above and below the mean; steps, image: total height; "
          "mixed: most of either; blocks: greatest height"),
    FIELD(wavelength, 0.02, 100.0,
          "[m] waves: wavelength; steps: length of one step up and one down; rough: spacing of the "
          "random heights; mixed: all three; blocks: edge of a block"),
    FIELD(slope, -1.0, 1.0,
          "[-] slope: rise per metre along x; mixed: steepest side of the pyramids; blocks: their "
          "greatest height per metre from x = 0; 0: amplitude everywhere"),
    MILD_FIELD(MildMapDef, seed, MILD_FIELD_UINT64, 1, 0, 1.8446744073709552e19,
               "[-] rough, mixed, blocks: seed of the random numbers"),
    MILD_FIELD_CHOICE(MildMapDef, patches, patterns, COUNT(patterns),
                      "[-] pattern in which the materials are laid out"),
    FIELD(patch_size, 0.01, 1000.0,
          "[m] stripes: width; checker: edge of a square; image: edge of a pixel"),
    FIELD(border, 0.0, 100.0,
          "[m] width over which neighbouring materials blend; 0 for a sharp border"),
};
const int mild_map_field_count = COUNT(mild_map_fields);

MildMapDef mild_map_def_default(void) {
    return (MildMapDef){.cell = 0.02,
                        .size = 8.0,
                        .amplitude = 0.02,
                        .wavelength = 0.8,
                        .slope = 0.1,
                        .seed = 1,
                        .patch_size = 0.5,
                        .patch_count = 2};
}

/* Not fmin and fmax: gcc 12 for aarch64 fails on their reductions over floats (internal error). */
static double smaller(double a, double b) {
    return a < b ? a : b;
}

static double larger(double a, double b) {
    return a > b ? a : b;
}

/* Sets the steepest gradient and the lowest and highest height. A bilinear cell is steepest along
 * its edges. */
static void map_measure(MildMap *map) {
    const Grid *grid = &map->heights;
    size_t stride = (size_t)grid->columns + 1;
    double along_x = 0.0, along_y = 0.0;
    map->low = INFINITY;
    map->high = -INFINITY;
    for (int j = 0; j <= grid->rows; j++) {
        for (int i = 0; i <= grid->columns; i++) {
            const float *at = map->height + (size_t)j * stride + (size_t)i;
            map->low = smaller(map->low, (double)*at);
            map->high = larger(map->high, (double)*at);
            if (i < grid->columns) {
                along_x = larger(along_x, fabs((double)at[1] - (double)*at) * grid->inverse_x);
            }
            if (j < grid->rows) {
                along_y = larger(along_y, fabs((double)at[stride] - (double)*at) * grid->inverse_y);
            }
        }
    }
    map->steepest = sqrt(along_x * along_x + along_y * along_y);
}

MildMap *mild_map_create(const MildMapDef *def, MildError *error) {
    if (mild_fields_check(mild_map_fields, mild_map_field_count, def, "terrain", error) !=
        MILD_OK) {
        return NULL;
    }
    MildMap *map = calloc(1, sizeof *map);
    if (!map) {
        mild_fail(error, MILD_ERROR_MEMORY, "terrain: out of memory");
        return NULL;
    }
    map->label_count = 1;
    if (shape_fill(map, def, error) != MILD_OK || pattern_fill(map, def, error) != MILD_OK) {
        mild_map_destroy(map);
        return NULL;
    }
    if (map->height) {
        map_measure(map);
    }
    map->steepest += fabs(map->slope);
    const Grid *h = &map->heights;
    const Grid *l = &map->labels;
    map->bytes = sizeof *map;
    if (map->height) {
        map->bytes += ((size_t)h->columns + 1) * ((size_t)h->rows + 1) * sizeof *map->height;
    }
    if (map->label) {
        map->bytes += (size_t)l->columns * (size_t)l->rows * sizeof *map->label;
    }
    return map;
}

void mild_map_destroy(MildMap *map) {
    if (!map) {
        return;
    }
    free(map->height);
    free(map->label);
    free(map);
}

size_t mild_map_bytes(const MildMap *map) {
    return map->bytes;
}

int mild_map_label_count(const MildMap *map) {
    return map->label_count;
}

int mild_map_is_level(const MildMap *map) {
    return map->height == NULL && map->slope == 0.0;
}

void mild_map_extent(const MildMap *map, double *x, double *y) {
    const Grid *h = &map->heights; /* all 0 when there are no heights */
    const Grid *l = &map->labels;  /* the same */
    *x = fmax(h->columns * h->cell_x, l->columns * l->cell_x);
    *y = fmax(h->rows * h->cell_y, l->rows * l->cell_y);
}

void mild_map_range(const MildMap *map, double *low, double *high) {
    *low = map->slope == 0.0 ? map->low : -INFINITY;
    *high = map->slope == 0.0 ? map->high : INFINITY;
}

double map_surface(const MildMap *map, double x, double y, double slope[2]) {
    const Grid *grid = &map->heights;
    double height = map->slope * x;
    slope[0] = map->slope;
    slope[1] = 0.0;
    if (!map->height) {
        return height;
    }
    GridPlace a = grid_place((x - grid->x0) * grid->inverse_x, grid->columns, grid->repeats);
    GridPlace b = grid_place((y - grid->y0) * grid->inverse_y, grid->rows, grid->repeats);
    Real own[2] = {(Real)slope[0], (Real)slope[1]};
    height = cell_surface(map->height, grid->columns, a, b, grid->inverse_x, grid->inverse_y,
                          height, own);
    slope[0] = own[0];
    slope[1] = own[1];
    return height;
}

Label map_label(const MildMap *map, double x, double y) {
    if (!map->label) {
        return (Label){0, 0, 0};
    }
    const Grid *grid = &map->labels;
    GridPlace a = grid_place((x - grid->x0) * grid->inverse_x, grid->columns, grid->repeats);
    GridPlace b = grid_place((y - grid->y0) * grid->inverse_y, grid->rows, grid->repeats);
    return map->label[(size_t)b.cell * (size_t)grid->columns + (size_t)a.cell];
}

static MapNumber map_number_of(double number) {
    const double high = float_rounded(number);
    return (MapNumber){(float)high, (float)(number - high)};
}

/* begin: [m] where the first cell begins. */
static MapAxis map_axis(int cells, int repeats, double begin, double cell) {
    return (MapAxis){cells, repeats, (float)(0.5 * round(-2.0 * begin / cell)), map_number_of(cell),
                     map_number_of(1.0 / cell)};
}

MapView map_view(const MildMap *map) {
    const Grid *h = &map->heights;
    const Grid *l = &map->labels;
    MapView view = {.height = map->height,
                    .slope = map_number_of(map->slope),
                    .labels = map->label_count,
                    .uneven = !mild_map_is_level(map)};
    if (map->height) {
        view.x = map_axis(h->columns, h->repeats, h->x0, h->cell_x);
        view.y = map_axis(h->rows, h->repeats, h->y0, h->cell_y);
    }
    if (map->label) {
        view.label_x = map_axis(l->columns, l->repeats, l->x0, l->cell_x);
        view.label_y = map_axis(l->rows, l->repeats, l->y0, l->cell_y);
    }
    return view;
}
