/* Elements of a shell while it is being made (sole_surface.c, sole_mesh.c). */
#ifndef MILD_GROUND_SAMPLES_H
#define MILD_GROUND_SAMPLES_H

#include "mild/ground.h"

typedef struct {
    double at[3];     /* [m] */
    double normal[3]; /* [-] outward */
    double area;      /* [m^2] */
    int64_t key;      /* shape; within sole_mesh.c the cell */
} Sample;

typedef struct {
    Sample *list;
    int count;
    int room;   /* of the list */
    int most;   /* of count */
    int failed; /* bool: out of memory */
    int full;   /* bool: more than `most` */
} Samples;

/* Counts what does not fit in `full` and `failed`. */
void samples_add(Samples *samples, const Sample *sample);

#endif
