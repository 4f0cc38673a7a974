/* What a sole is made of: a plane raster (sole.c), or a shell: elements anywhere on a body
 * (sole_surface.c), a foot that is no plane, or a shank, whose shells in robot.ini make one. */
#ifndef MILD_GROUND_SOLE_H
#define MILD_GROUND_SOLE_H

#include "mild/ground.h"

#define SOLE_ELEMENTS_MAX 65536

/* Arrays of a shell, in this order. */
enum { SOLE_X, SOLE_Y, SOLE_Z, SOLE_NORMAL, SOLE_AREA = SOLE_NORMAL + 3, SOLE_ARRAYS };
/* Arrays of a plane raster, after x and y. The distance to the edge of the outline over a cell has
 * this mean and this standard deviation. */
enum { SOLE_EDGE = SOLE_Y + 1, SOLE_SPREAD, SOLE_PLANE_ARRAYS };

struct MildSole {
    int elements;
    int shell;       /* bool: its elements have a height, normal and area each */
    double pitch;    /* [m] */
    double width;    /* [m] Bekker's b */
    double z;        /* [m] of the plane; of a shell the mean over its elements */
    double values[]; /* [SOLE_PLANE_ARRAYS or SOLE_ARRAYS][elements] */
};

#define MATERIAL_PITCH 0.0195 /* [m] edge of the element that a material's numbers belong to */
/* [m] A sole that chooses its pitch has no more elements than one of this pitch may have. */
#define SOLE_PITCH_LEAST (0.5 * MATERIAL_PITCH)

/* The heap of an element, in radii of the disc of an element of MATERIAL_PITCH: it closes from
 * `begin` on, over `width`, times tan(alpha)/nu. The elements of a shell have the cone of a disc as
 * wide as the shell; its rim lowers their load (rim.h). */
typedef struct {
    double begin; /* [-] */
    double width; /* [-] */
} SoleHeap;
SoleHeap sole_heap(const MildSole *sole, int element);

#endif
