/* The bodies with shells of a batch's robots, on its device: those of mild_batch_create, and
 * those of a layer that steps the robots and says itself when one is near the ground. */
#ifndef MILD_BODIES_BATCH_H
#define MILD_BODIES_BATCH_H

#include "ground/batch/batch.h"

/* soles: [feet + shells]; those of the feet are the batch's. materials: [count] those of the
 * batch. map: that of the batch or NULL. worn: bool, elements have wear. error: not NULL. */
MildStatus batch_bodies_open(BatchBodies *bodies, const MildBatch *batch,
                             const MildSole *const *soles, int shells, const MildMap *map,
                             const MildMaterial *materials, int count, int worn, MildError *error);
void batch_bodies_close(const BatchBodies *bodies, int device);
/* `curves` of bodies_step for the batch's materials. */
int batch_bodies_curves(const MildBatch *batch);

/* ---- of a batch that steps them itself ---- */
/* After batch_bodies_open: memory of mild_batch_step. */
MildStatus batch_bodies_ready(MildBatch *batch, MildError *error);
/* For a batch that has the feet's new table. Adds to the batch's curves. Fails with nothing
 * changed. */
MildStatus batch_bodies_set_materials(MildBatch *batch, const MildMaterial *materials, int count,
                                      MildError *error);
/* For a batch that has the new map; they forget. Fails with nothing changed. */
MildStatus batch_bodies_set_map(MildBatch *batch, double steepest, MildError *error);
/* What lies under the shells of a robot of the CPU forgets; where there are none, nothing. */
void batch_bodies_reset(const BatchBodies *bodies, size_t robot);
/* Before and after the step of the feet. */
MildStatus batch_bodies_begin(const MildBatch *batch, const MildBatchInput *input,
                              const MildBatchOutput *output, int advance, MildStream stream,
                              MildError *error);
MildStatus batch_bodies_end(const MildBatch *batch, const MildBatchInput *input,
                            const MildBatchOutput *output, int advance, MildStream stream,
                            MildError *error);

/* The same on the CPU: host.c; and on a GPU: bodies.cu, or without_cuda.c. */
struct BodiesCall; /* of bodies_robot.h */
void host_bodies_begin(const struct BodiesCall *call);
void host_bodies_end(const struct BodiesCall *call);
MildStatus gpu_bodies_begin(const struct BodiesCall *call, int device, MildStream stream,
                            MildError *error);
MildStatus gpu_bodies_end(const struct BodiesCall *call, int device, MildStream stream,
                          MildError *error);

/* What the ground under the shells of robots remembers, from and to grounds. */
MildStatus batch_bodies_load(MildBatch *batch, int first, int count,
                             const MildGround *const *grounds, MildError *error);
MildStatus batch_bodies_store(const MildBatch *batch, int first, int count,
                              MildGround *const *grounds, MildError *error);

#endif
