/* What the ground under the shells of a batch remembers, from and to mild/ground.h. */
#define MILD_REAL_FLOAT
#include "ground/batch/bodies_batch.h"

#include <stdlib.h>

#include "device/device.h"
#include "ground/batch/bodies.h"
#include "ground/batch/element_memory.h"
#include "ground/step/inside.h"

/* The state of bodies.h for a material of ground/step/state.h. */
static int state_of(int32_t material) {
    return material >= 0                 ? 1 + (material & 0xff)
           : material == MATERIAL_FREE   ? BODIES_FREE
           : material == MATERIAL_BURIED ? BODIES_BURIED
                                         : BODIES_NONE;
}

static int32_t material_of(int state) {
    return state > 0                ? state - 1
           : state == BODIES_FREE   ? MATERIAL_FREE
           : state == BODIES_BURIED ? MATERIAL_BURIED
                                    : MATERIAL_NONE;
}

/* Planes count from the world's origin in a ground, and from where the body was in a batch; so that
 * the first step finds them the same, the body was at the origin. */
static void shell_load(const MildGround *ground, int f, const BodiesMemory *to) {
    const Memory of = mild_inside_memory(ground, f);
    const int uneven = ground->uneven[f];
    for (int e = 0; e < ground->elements[f]; e++) {
        float *at = to->element + e;
        element_load(&of, e, at, to->next);
        to->worn[e] = (float)of.worn[e];
        const int there = uneven && of.material[e] != MATERIAL_NONE;
        at[BODIES_PLANE * to->next] = there ? (float)of.plane[e] : CONTACT_NO_PLANE;
        at[(BODIES_PLANE + 1) * to->next] = there ? (float)of.slope_x[e] : 0.0f;
        at[(BODIES_PLANE + 2) * to->next] = there ? (float)of.slope_y[e] : 0.0f;
        at[BODIES_STATE * to->next] = (float)state_of(of.material[e]);
        at[BODIES_AREA_SHARE * to->next] = (float)of.area_share[e];
    }
    to->body[BODIES_STEPPED] = uneven ? 1.0f : 0.0f;
    to->body[BODIES_TOUCHED] = 1.0f;
}

/* The other way. plane: MildGround.uneven of a ground that the batch has stepped. */
static void shell_store(const BodiesMemory *from, int plane, MildGround *ground, int f) {
    const Memory of = mild_inside_memory(ground, f);
    const float *last = from->body;
    const int uneven = last[BODIES_STEPPED] > 0.0f ? plane : 0;
    int touched = 0;
    for (int e = 0; e < ground->elements[f]; e++) {
        const float *at = from->element + e;
        element_store(at, from->next, &of, e);
        of.worn[e] = (double)from->worn[e];
        of.material[e] = material_of((int)at[BODIES_STATE * from->next]);
        of.area_share[e] = (double)at[BODIES_AREA_SHARE * from->next];
        touched += of.material[e] != MATERIAL_NONE;
        if (uneven && (of.material[e] >= 0 || of.material[e] == MATERIAL_FREE)) {
            of.slope_x[e] = (double)at[(BODIES_PLANE + 1) * from->next];
            of.slope_y[e] = (double)at[(BODIES_PLANE + 2) * from->next];
            of.plane[e] = (double)at[BODIES_PLANE * from->next] - of.slope_x[e] * (double)last[0] -
                          of.slope_y[e] * (double)last[1] + (double)last[2] - (double)last[3];
        }
    }
    ground->uneven[f] = uneven;
    ground->touched[f] = touched;
}

/* Where shell f begins in the memory of a robot. */
static BodiesMemory shell_at(const BatchShape *shape, float *memory, int f) {
    for (int b = shape->feet; b < f; b++) {
        memory += bodies_memory_numbers(shape->elements[b], 1);
    }
    return bodies_memory(memory, shape->elements[f], 1);
}

static float *one_robot(const BatchBodies *bodies, MildError *error) {
    float *memory = calloc(bodies->numbers, sizeof *memory);
    if (!memory) {
        mild_fail(error, MILD_ERROR_MEMORY, "batch: out of memory");
    }
    return memory;
}

MildStatus batch_bodies_load(MildBatch *batch, int first, int count,
                             const MildGround *const *grounds, MildError *error) {
    const BatchShape *shape = &batch->shape;
    const size_t numbers = batch->bodies.numbers;
    float *memory = one_robot(&batch->bodies, error);
    MildStatus status = memory ? MILD_OK : MILD_ERROR_MEMORY;
    for (int i = 0; i < count && status == MILD_OK; i++) {
        for (int f = shape->feet; f < shape->soles; f++) {
            const BodiesMemory to = shell_at(shape, memory, f);
            shell_load(grounds[i], f, &to);
        }
        status = device_copy(batch->device, batch->bodies.memory + (size_t)(first + i) * numbers,
                             memory, numbers * sizeof *memory, error);
    }
    free(memory);
    return status;
}

MildStatus batch_bodies_store(const MildBatch *batch, int first, int count,
                              MildGround *const *grounds, MildError *error) {
    const BatchShape *shape = &batch->shape;
    const size_t numbers = batch->bodies.numbers;
    const int has_plane = shape->map && batch->arrays.map.uneven;
    float *memory = one_robot(&batch->bodies, error);
    MildStatus status = memory ? MILD_OK : MILD_ERROR_MEMORY;
    for (int i = 0; i < count && status == MILD_OK; i++) {
        status =
            device_copy(batch->device, memory, batch->bodies.memory + (size_t)(first + i) * numbers,
                        numbers * sizeof *memory, error);
        for (int f = shape->feet; f < shape->soles && status == MILD_OK; f++) {
            const BodiesMemory from = shell_at(shape, memory, f);
            shell_store(&from, has_plane, grounds[i], f);
        }
    }
    free(memory);
    return status;
}
