/* A step of src/ground/batch/bodies.h in double, whatever Real the text under test is compiled
 * for. */
#ifndef BODIES_CASE_H
#define BODIES_CASE_H

#include "contact_case.h"

enum { BODIES = 5, BODIES_ELEMENTS = 512, BODIES_BEYOND = 5, BODIES_PLACES = 8 };

typedef struct {
    int feet, bodies;
    int elements[BODIES], shell[BODIES]; /* shell: bool */
    /* x, y, z, normal, area over that of the law */
    double place[7][BODIES][BODIES_ELEMENTS];
    double begin[BODIES][BODIES_ELEMENTS], width[BODIES][BODIES_ELEMENTS]; /* of SoleHeap */
    double z[BODIES], square[BODIES], middle[BODIES][3], half[BODIES][3], radius[BODIES];
    CaseMaterial material[CASE_LABELS][BODIES];
    double dt, tolerance, height, steepest;
    int limit, has_map;
    MapView map;
    double map_origin[2];
    double position[BODIES][3], rotation[BODIES][9], velocity[BODIES][6];
    double inverse_inertia[36 * BODIES * BODIES], free_velocity[6 * BODIES];
    /* in and out */
    double memory[CASE_MEMORY + BODIES_BEYOND][BODIES][BODIES_ELEMENTS], own[BODIES_PLACES][BODIES];
    /* out */
    double wrench[6 * BODIES], after[6 * BODIES], foot[BODIES][6], residual;
    int iterations;
} BodiesCase;

/* Solves and advances. */
void bodies_double(BodiesCase *c);
void bodies_float(BodiesCase *c);
void bodies_float_shared(BodiesCase *c); /* no equations in registers */

#endif
