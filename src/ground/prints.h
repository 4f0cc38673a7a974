/* What pressed ground remembers: the greatest depth of each cell of a world-fixed grid, in a
 * bounded cache of tiles. Like a processor's cache it has sets of PRINT_WAYS tiles, chosen by a
 * hash of the tile's place; a new tile takes the place of the oldest in its set. Every access is
 * O(1) and allocates nothing. */
#ifndef MILD_GROUND_PRINTS_H
#define MILD_GROUND_PRINTS_H

#include "ground/contact.h"

#define PRINT_EDGE 8    /* cells along a tile's edge */
#define PRINT_WAYS 8    /* tiles in a set */
#define PRINT_UNIT 1e-5 /* [m] depths are stored as whole multiples, up to 0.65 m */
#define PRINT_SAMPLES                                                                              \
    3 /* points along an element's edge at which it touches the cells, see prints.c */

typedef struct {
    uint32_t
        place; /* column and row of the tile, 16 bits each: the world repeats after 65536 tiles */
    uint32_t time; /* of the last change; 0: empty */
} PrintKey;

typedef struct {
    PrintKey *keys;   /* [sets][PRINT_WAYS] */
    uint16_t *depths; /* [tiles][PRINT_EDGE][PRINT_EDGE] [PRINT_UNIT] */
    int tiles;
    double inverse_cell; /* [1/m] */
    uint32_t time;
} Prints;

/* Where an element lies: centre [m], the foot's rotation, pitch. */
typedef struct {
    double x, y, pitch;
    const double *rotation;
} PrintElement;

size_t prints_bytes(int tiles);
/* tiles, rounded up to whole sets. */
int prints_round(int tiles);
Prints ground_prints(const MildGround *ground);
void prints_clear(const Prints *prints);

/* Mean depth of the cells under an element [m]. */
double prints_read(const Prints *prints, const PrintElement *element);
/* The cells under an element have been pressed down to `depth`. */
void prints_press(const Prints *prints, const PrintElement *element, double depth);
double prints_depth(const Prints *prints, double x, double y);
/* Bool: the two points lie in the same cell. */
int prints_same_cell(const Prints *prints, double x0, double y0, double x1, double y1);

#endif
