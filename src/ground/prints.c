#include "ground/prints.h"

#include <string.h>

#define TILE_CELLS (PRINT_EDGE * PRINT_EDGE)
#define PRINT_FAR 1e8 /* [tiles] farther from the origin nothing is remembered; NaN neither */

int prints_round(int tiles) {
    if (tiles <= 0) {
        return 0;
    }
    if (tiles > MILD_PRINT_TILES_MAX) {
        tiles = MILD_PRINT_TILES_MAX;
    }
    return (tiles + PRINT_WAYS - 1) / PRINT_WAYS * PRINT_WAYS;
}

size_t prints_bytes(int tiles) {
    return (size_t)tiles * (sizeof(PrintKey) + TILE_CELLS * sizeof(uint16_t));
}

void prints_clear(const Prints *prints) {
    memset(prints->keys, 0, prints_bytes(prints->tiles));
}

/* A cell: its tile's place and its number in the tile. */
typedef struct {
    uint32_t place;
    int cell; /* -1: too far away */
} Spot;

static Spot spot_at(const Prints *prints, double x, double y) {
    double u = x * prints->inverse_cell, v = y * prints->inverse_cell;
    double column = floor(u / PRINT_EDGE), row = floor(v / PRINT_EDGE);
    if (!(fabs(column) < PRINT_FAR && fabs(row) < PRINT_FAR)) {
        return (Spot){0, -1};
    }
    int i = (int)(u - PRINT_EDGE * column), j = (int)(v - PRINT_EDGE * row);
    uint32_t place = ((uint32_t)(int32_t)column & 0xffffu) | (uint32_t)(int32_t)row << 16;
    return (Spot){place, (j < PRINT_EDGE ? j : PRINT_EDGE - 1) * PRINT_EDGE +
                             (i < PRINT_EDGE ? i : PRINT_EDGE - 1)};
}

static int set_of(const Prints *prints, uint32_t place) {
    uint32_t mixed = place * 0x9e3779b1u;
    mixed = (mixed ^ (mixed >> 15)) * 0x85ebca77u;
    mixed ^= mixed >> 13;
    return (int)((uint64_t)mixed * (uint64_t)(prints->tiles / PRINT_WAYS) >> 32) * PRINT_WAYS;
}

/* Tile at a place, or -1. */
static int tile_find(const Prints *prints, uint32_t place) {
    int set = set_of(prints, place);
    for (int k = set; k < set + PRINT_WAYS; k++) {
        if (prints->keys[k].place == place && prints->keys[k].time > 0) {
            return k;
        }
    }
    return -1;
}

/* The same; a place that has none takes the empty or oldest tile of its set. */
static int tile_take(const Prints *prints, uint32_t place) {
    int tile = tile_find(prints, place), set = set_of(prints, place);
    if (tile < 0) {
        tile = set;
        for (int k = set + 1; k < set + PRINT_WAYS; k++) {
            if (prints->keys[k].time < prints->keys[tile].time) {
                tile = k;
            }
        }
        prints->keys[tile].place = place;
        memset(prints->depths + (size_t)tile * TILE_CELLS, 0, TILE_CELLS * sizeof *prints->depths);
    }
    prints->keys[tile].time = prints->time;
    return tile;
}

/* An element touches the cells at 3 x 3 points, a third of the pitch apart. The cells' edge is half
 * the pitch, more than sqrt(2) of that distance, so that under neighbouring elements no cell is
 * left out, however they are turned. */
static void element_sample(const PrintElement *element, int k, double *x, double *y) {
    double step = element->pitch / PRINT_SAMPLES;
    double a = step * (k % PRINT_SAMPLES - PRINT_SAMPLES / 2),
           b = step * (k / PRINT_SAMPLES - PRINT_SAMPLES / 2);
    *x = element->x + element->rotation[0] * a + element->rotation[1] * b;
    *y = element->y + element->rotation[3] * a + element->rotation[4] * b;
}

double prints_read(const Prints *prints, const PrintElement *element) {
    uint32_t place = 0;
    int tile = -2; /* not looked for yet */
    double sum = 0.0;
    for (int k = 0; k < PRINT_SAMPLES * PRINT_SAMPLES; k++) {
        double x, y;
        element_sample(element, k, &x, &y);
        Spot spot = spot_at(prints, x, y);
        if (spot.cell < 0) {
            continue;
        }
        if (tile == -2 || spot.place != place) {
            tile = tile_find(prints, place = spot.place);
        }
        if (tile >= 0) {
            sum += prints->depths[(size_t)tile * TILE_CELLS + (size_t)spot.cell];
        }
    }
    return sum * (PRINT_UNIT / (PRINT_SAMPLES * PRINT_SAMPLES));
}

void prints_press(const Prints *prints, const PrintElement *element, double depth) {
    double units = depth / PRINT_UNIT + 0.5;
    uint16_t pressed =
        (uint16_t)(units > 1.0 ? (units < 65535.0 ? units : 65535.0) : 0.0); /* NaN: 0 */
    for (int k = 0; pressed > 0 && k < PRINT_SAMPLES * PRINT_SAMPLES; k++) {
        double x, y;
        element_sample(element, k, &x, &y);
        Spot spot = spot_at(prints, x, y);
        if (spot.cell < 0) {
            continue;
        }
        uint16_t *at =
            prints->depths + (size_t)tile_take(prints, spot.place) * TILE_CELLS + spot.cell;
        if (*at < pressed) {
            *at = pressed;
        }
    }
}

double prints_depth(const Prints *prints, double x, double y) {
    Spot spot = spot_at(prints, x, y);
    int tile = prints->tiles > 0 && spot.cell >= 0 ? tile_find(prints, spot.place) : -1;
    return tile < 0 ? 0.0
                    : PRINT_UNIT * prints->depths[(size_t)tile * TILE_CELLS + (size_t)spot.cell];
}

int prints_same_cell(const Prints *prints, double x0, double y0, double x1, double y1) {
    return floor(x0 * prints->inverse_cell) == floor(x1 * prints->inverse_cell) &&
           floor(y0 * prints->inverse_cell) == floor(y1 * prints->inverse_cell);
}

double mild_ground_print_at(const MildGround *ground, double x, double y) {
    Prints prints = ground_prints(ground);
    return prints_depth(&prints, x, y);
}
