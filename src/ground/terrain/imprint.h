/* Imprints: the greatest depth of each cell of a grid fixed in the world, kept in a cache of tiles
 * of bounded size.
 *
 * The cache is set-associative like a processor's. A hash of the tile's place chooses a set of
 * IMPRINT_WAYS tiles, and a new tile replaces the oldest of its set. Every access is O(1) and
 * allocates nothing. */
#ifndef MILD_GROUND_IMPRINT_H
#define MILD_GROUND_IMPRINT_H

#include <stddef.h>
#include <stdint.h>

#define IMPRINT_EDGE 8    /* cells along a tile's edge */
#define IMPRINT_WAYS 8    /* tiles in a set */
#define IMPRINT_UNIT 1e-5 /* [m] unit of the stored depths, which reach 0.65 m */
#define IMPRINT_SAMPLES 3 /* sample points along an element's edge */

typedef struct {
    uint32_t place; /* column | row << 16 of the tile, so the world repeats after 65536 tiles */
    uint32_t time;  /* step of the last change; 0: empty */
} ImprintKey;

typedef struct {
    ImprintKey *keys;    /* [sets][IMPRINT_WAYS] */
    uint16_t *depths;    /* [tiles][IMPRINT_EDGE][IMPRINT_EDGE] in IMPRINT_UNIT */
    int tiles;           /* sets times ways */
    double inverse_cell; /* [1/m] */
    uint32_t time;       /* number of this step, above 0 */
} Imprints;

/* Where an element lies. */
typedef struct {
    double x, y;            /* [m] its centre, world */
    double pitch;           /* [m] its edge */
    const double *rotation; /* [9] of the foot */
} ImprintElement;

/* Bytes of keys and depths. */
size_t imprints_bytes(int tiles);
/* `tiles` rounded up to whole sets, at most `most`. */
int imprints_round(int tiles, int most);
/* Forgets everything. */
void imprints_clear(const Imprints *imprints);

/* Mean depth of the cells under an element [m]. */
double imprints_read(const Imprints *imprints, const ImprintElement *element);
/* Records that the cells under an element have been pressed down to `depth` [m]. */
void imprints_press(const Imprints *imprints, const ImprintElement *element, double depth);
/* Sets the cells under an element to `depth` [m]. */
void imprints_fill(const Imprints *imprints, const ImprintElement *element, double depth);
/* Depth of the cell that holds a point [m]; 0 where nothing is remembered. */
double imprints_depth(const Imprints *imprints, double x, double y);
/* Bool: the two points lie in the same cell. */
int imprints_same_cell(const Imprints *imprints, double x0, double y0, double x1, double y1);

#endif
