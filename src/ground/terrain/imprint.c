#include "ground/terrain/imprint.h"

#include <math.h>
#include <string.h>

#define TILE_CELLS (IMPRINT_EDGE * IMPRINT_EDGE)
#define IMPRINT_FAR 1e8 /* [tiles] beyond this distance from the origin nothing is remembered */

int imprints_round(int tiles, int most) {
    if (tiles <= 0) {
        return 0;
    }
    if (tiles > most) {
        tiles = most;
    }
    return (tiles + IMPRINT_WAYS - 1) / IMPRINT_WAYS * IMPRINT_WAYS;
}

size_t imprints_bytes(int tiles) {
    return (size_t)tiles * (sizeof(ImprintKey) + TILE_CELLS * sizeof(uint16_t));
}

void imprints_clear(const Imprints *imprints) {
    memset(imprints->keys, 0, imprints_bytes(imprints->tiles));
}

/* A cell in the world. */
typedef struct {
    uint32_t place; /* of its tile, as in ImprintKey */
    int cell;       /* index within the tile; -1: too far away, or NaN */
} Spot;

static Spot spot_at(const Imprints *imprints, double x, double y) {
    double u = x * imprints->inverse_cell, v = y * imprints->inverse_cell;
    double column = floor(u / IMPRINT_EDGE), row = floor(v / IMPRINT_EDGE);
    if (!(fabs(column) < IMPRINT_FAR && fabs(row) < IMPRINT_FAR)) {
        return (Spot){0, -1};
    }
    int i = (int)(u - IMPRINT_EDGE * column), j = (int)(v - IMPRINT_EDGE * row);
    uint32_t place = ((uint32_t)(int32_t)column & 0xffffu) | (uint32_t)(int32_t)row << 16;
    return (Spot){place, (j < IMPRINT_EDGE ? j : IMPRINT_EDGE - 1) * IMPRINT_EDGE +
                             (i < IMPRINT_EDGE ? i : IMPRINT_EDGE - 1)};
}

static int set_of(const Imprints *imprints, uint32_t place) {
    uint32_t mixed = place * 0x9e3779b1u;
    mixed = (mixed ^ (mixed >> 15)) * 0x85ebca77u;
    mixed ^= mixed >> 13;
    return (int)((uint64_t)mixed * (uint64_t)(imprints->tiles / IMPRINT_WAYS) >> 32) * IMPRINT_WAYS;
}

/* Tile at a place, or -1. */
static int tile_find(const Imprints *imprints, uint32_t place) {
    int set = set_of(imprints, place);
    for (int k = set; k < set + IMPRINT_WAYS; k++) {
        if (imprints->keys[k].place == place && imprints->keys[k].time > 0) {
            return k;
        }
    }
    return -1;
}

/* Tile at a place. A place without one takes an empty tile of its set, or else the oldest. */
static int tile_take(const Imprints *imprints, uint32_t place) {
    int tile = tile_find(imprints, place), set = set_of(imprints, place);
    if (tile < 0) {
        tile = set;
        for (int k = set + 1; k < set + IMPRINT_WAYS; k++) {
            if (imprints->keys[k].time < imprints->keys[tile].time) {
                tile = k;
            }
        }
        imprints->keys[tile].place = place;
        memset(imprints->depths + (size_t)tile * TILE_CELLS, 0,
               TILE_CELLS * sizeof *imprints->depths);
    }
    imprints->keys[tile].time = imprints->time;
    return tile;
}

/* Sample point k of an element. The 3 x 3 sample points are a third of the pitch apart. The edge of
 * a cell is half the pitch, which is more than sqrt(2) times that distance, so neighbouring
 * elements miss no cell between them at any orientation. */
static void element_sample(const ImprintElement *element, int k, double *x, double *y) {
    double step = element->pitch / IMPRINT_SAMPLES;
    double a = step * (k % IMPRINT_SAMPLES - IMPRINT_SAMPLES / 2);
    double b = step * (k / IMPRINT_SAMPLES - IMPRINT_SAMPLES / 2);
    *x = element->x + element->rotation[0] * a + element->rotation[1] * b;
    *y = element->y + element->rotation[3] * a + element->rotation[4] * b;
}

double imprints_read(const Imprints *imprints, const ImprintElement *element) {
    uint32_t place = 0;
    int tile = -2; /* no lookup yet */
    double sum = 0.0;
    for (int k = 0; k < IMPRINT_SAMPLES * IMPRINT_SAMPLES; k++) {
        double x, y;
        element_sample(element, k, &x, &y);
        Spot spot = spot_at(imprints, x, y);
        if (spot.cell < 0) {
            continue;
        }
        if (tile == -2 || spot.place != place) {
            tile = tile_find(imprints, place = spot.place);
        }
        if (tile >= 0) {
            sum += imprints->depths[(size_t)tile * TILE_CELLS + (size_t)spot.cell];
        }
    }
    return sum * (IMPRINT_UNIT / (IMPRINT_SAMPLES * IMPRINT_SAMPLES));
}

/* least: [units] of a cell that was shallower; a deeper one becomes `most` at most. */
static void set_cells(const Imprints *imprints, const ImprintElement *element, uint16_t least,
                      uint16_t most) {
    for (int k = 0; k < IMPRINT_SAMPLES * IMPRINT_SAMPLES; k++) {
        double x, y;
        element_sample(element, k, &x, &y);
        Spot spot = spot_at(imprints, x, y);
        if (spot.cell < 0) {
            continue;
        }
        uint16_t *at =
            imprints->depths + (size_t)tile_take(imprints, spot.place) * TILE_CELLS + spot.cell;
        if (*at < least) {
            *at = least;
        }
        if (*at > most) {
            *at = most;
        }
    }
}

/* [units] NaN: 0 */
static uint16_t units_of(double depth) {
    const double units = depth / IMPRINT_UNIT + 0.5;
    return (uint16_t)(units > 1.0 ? (units < 65535.0 ? units : 65535.0) : 0.0);
}

void imprints_press(const Imprints *imprints, const ImprintElement *element, double depth) {
    const uint16_t pressed = units_of(depth);
    if (pressed > 0) {
        set_cells(imprints, element, pressed, UINT16_MAX);
    }
}

void imprints_fill(const Imprints *imprints, const ImprintElement *element, double depth) {
    const uint16_t left = units_of(depth);
    set_cells(imprints, element, left, left);
}

double imprints_depth(const Imprints *imprints, double x, double y) {
    Spot spot = spot_at(imprints, x, y);
    int tile = imprints->tiles > 0 && spot.cell >= 0 ? tile_find(imprints, spot.place) : -1;
    return tile < 0
               ? 0.0
               : IMPRINT_UNIT * imprints->depths[(size_t)tile * TILE_CELLS + (size_t)spot.cell];
}

int imprints_same_cell(const Imprints *imprints, double x0, double y0, double x1, double y1) {
    return floor(x0 * imprints->inverse_cell) == floor(x1 * imprints->inverse_cell) &&
           floor(y0 * imprints->inverse_cell) == floor(y1 * imprints->inverse_cell);
}
