/* What a ground remembers of an element, in double, from and to a batch's numbers of it, in float.
 * Include it where MILD_REAL_FLOAT is defined. */
#ifndef MILD_GROUND_BATCH_ELEMENT_MEMORY_H
#define MILD_GROUND_BATCH_ELEMENT_MEMORY_H

#include "ground/batch/contact.h"
#include "ground/step/inside.h"

/* A sole's arrays in the order of ElementMemory. */
enum { ELEMENT_ARRAYS = sizeof(ElementMemory) / sizeof(Real) };
typedef struct {
    double *number[ELEMENT_ARRAYS];
} ElementArrays;

static inline ElementArrays element_arrays(const Memory *of) {
    return (ElementArrays){{of->depth_max, of->middle, of->front_speed, of->drift, of->pending_x,
                            of->pending_y, of->held_x, of->held_y, of->held_stiffness}};
}

/* Element e of a sole to the numbers at `at`, each `next` after the one before. */
static inline void element_load(const Memory *of, int e, float *at, int next) {
    const ElementArrays arrays = element_arrays(of);
    union {
        Real number[ELEMENT_ARRAYS];
        ElementMemory memory;
    } element;
    for (int n = 0; n < ELEMENT_ARRAYS; n++) {
        element.number[n] = (Real)arrays.number[n][e];
    }
    contact_record(at, next, &element.memory);
}

/* The other way. */
static inline void element_store(const float *at, int next, const Memory *of, int e) {
    const ElementArrays arrays = element_arrays(of);
    union {
        ElementMemory memory;
        Real number[ELEMENT_ARRAYS];
    } element = {contact_recall(at, next)};
    for (int n = 0; n < ELEMENT_ARRAYS; n++) {
        arrays.number[n][e] = (double)element.number[n];
    }
}

#endif
