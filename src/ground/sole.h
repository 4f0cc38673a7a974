/* What a sole is made of: a plane raster (sole.c), or elements anywhere on a body (surface.c). */
#ifndef MILD_GROUND_SOLE_H
#define MILD_GROUND_SOLE_H

#include "mild/ground.h"

#define SOLE_ELEMENTS_MAX 65536

/* Arrays of a surface, in this order; a plane raster has the first two. */
enum { SOLE_X, SOLE_Y, SOLE_Z, SOLE_NORMAL, SOLE_AREA = SOLE_NORMAL + 3, SOLE_ARRAYS };

struct MildSole {
    int elements;
    int faces;       /* bool: a surface, whose elements have a height, normal and area each */
    double pitch;    /* [m] */
    double width;    /* [m] Bekker's b */
    double z;        /* [m] of the plane; of a surface the mean over its elements */
    double values[]; /* [2 or SOLE_ARRAYS][elements] */
};

#endif
