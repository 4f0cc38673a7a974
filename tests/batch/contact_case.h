/* A contact step of one robot in double, whatever Real the text under test is compiled for. */
#ifndef CONTACT_CASE_H
#define CONTACT_CASE_H

#include "contact_case.h"
#include "ground/terrain/map_view.h"

enum { CASE_FEET = 4, CASE_ELEMENTS = 256, CASE_MEMORY = 10, CASE_LAW = 14, CASE_LABELS = 4 };
enum { CASE_WORN = CASE_MEMORY - 1 }; /* of ContactCase.memory */

typedef struct {
    double law[CASE_LAW], recovery, mu, k_drift, b_drift, exit_drag, entry_drag;
    double cohesion, shear_length, projects, slip_rate, regain_rate, grip, growth, side;
    int curves;
} CaseMaterial;

typedef struct {
    int feet, groups, per;
    int points; /* bool: by the version for feet that transmit no moment */
    int elements[CASE_FEET];
    double x[CASE_FEET][CASE_ELEMENTS], y[CASE_FEET][CASE_ELEMENTS], z[CASE_FEET];
    double begin[CASE_FEET][CASE_ELEMENTS], width[CASE_FEET][CASE_ELEMENTS]; /* of SoleHeap */
    double area[CASE_FEET];
    double dt, tolerance, height;
    int limit, begins;                  /* as in ContactSetup */
    CaseMaterial material[CASE_LABELS]; /* [0] without a map */
    double position[3 * CASE_FEET], rotation[9 * CASE_FEET], velocity[6 * CASE_FEET];
    double inverse_inertia[36 * CASE_FEET * CASE_FEET], free_velocity[6 * CASE_FEET];
    double memory[CASE_MEMORY][CASE_FEET][CASE_ELEMENTS]; /* in and out */
    MapView map;                                          /* the next three: with a map */
    double map_origin[2];
    double plane[4][CASE_FEET][CASE_ELEMENTS], last[5][CASE_FEET]; /* in and out, see contact.h */
    /* out */
    double wrench[6 * CASE_FEET], after[6 * CASE_FEET], residual;
    double foot[CASE_FEET][6];                   /* ContactFoot */
    double element[4][CASE_FEET][CASE_ELEMENTS]; /* as ContactResult.elements */
    int iterations;
} ContactCase;

/* Solves and advances, on level ground and on a map. */
void contact_level_double(ContactCase *c);
void contact_level_float(ContactCase *c);
void contact_map_double(ContactCase *c);
void contact_map_float(ContactCase *c);

/* A step of src/ground/batch/bodies.h in double, whatever Real the text under test is compiled
 * for. */

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
