/* The bodies with shells of a batch's robots, on its device. For the layer that steps the robots,
 * which says when one is near the ground. */
#ifndef MILD_BODIES_BATCH_H
#define MILD_BODIES_BATCH_H

#include "ground/batch/batch.h"

struct BodiesSetup; /* of bodies.h */

typedef struct {
    struct BodiesSetup *setup; /* in float; NULL: no robot has such bodies */
    float *memory;             /* [robots][numbers] of the surfaces */
    size_t numbers;            /* of a robot */
    size_t bytes;              /* of the device, without memory */
    /* what the setup points to */
    float *places;
    MaterialNumbers *materials; /* [count + 1][bodies] */
} BatchBodies;

/* soles: [feet + surfaces]; those of the feet are the batch's. materials: [count] those of the
 * batch. map: that of the batch or NULL. error: not NULL. */
MildStatus batch_bodies_open(BatchBodies *bodies, const MildBatch *batch,
                             const MildSole *const *soles, int surfaces, const MildMap *map,
                             const MildMaterial *materials, int count, MildError *error);
void batch_bodies_close(const BatchBodies *bodies, int device);

#endif
