#define MILD_REAL_FLOAT

#include "ground/batch/bodies_batch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "device/device.h"
#include "ground/batch/bodies_robot.h"
#include "ground/batch/element_memory.h"
#include "ground/step/inside.h"

_Static_assert(sizeof(ContactMaterial) == sizeof(MaterialNumbers), "the same numbers");
_Static_assert(BODIES_MAX >= MILD_BATCH_FEET_MAX, "room for all");

/* Arrays of a shell's elements: x, y and those of BodiesSole.face. */
enum { PLACES = 7 };

/* Point of element i. */
static void element_at(const MildSole *sole, int i, double at[3]) {
    const double *z = mild_sole_surface_z(sole);
    at[0] = mild_sole_x(sole)[i];
    at[1] = mild_sole_y(sole)[i];
    at[2] = z ? z[i] : mild_sole_z(sole);
}

/* Bounding box and radius, as foot_set_bounds. */
static void set_bounds(BodiesSole *to, const MildSole *sole) {
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    double radius = 0;
    for (int i = 0; i < mild_sole_elements(sole); i++) {
        double p[3];
        element_at(sole, i, p);
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], p[k]);
            high[k] = fmax(high[k], p[k]);
        }
        radius = fmax(radius, sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]));
    }
    for (int k = 0; k < 3; k++) {
        to->middle[k] = (float)(0.5 * (low[k] + high[k]));
        to->half[k] = (float)(0.5 * (high[k] - low[k]));
    }
    to->radius = (float)radius;
}

/* What all bodies have; the arrays are set by the callers. */
static void set_sole(BodiesSole *to, const MildSole *sole) {
    const double pitch = mild_sole_pitch(sole);
    to->z = (float)mild_sole_z(sole);
    to->square = (float)(pitch * pitch);
    to->elements = mild_sole_elements(sole);
    set_bounds(to, sole);
}

static void set_foot(BodiesSole *to, const MildBatch *batch, const MildSole *sole, int f) {
    const BatchShape *shape = &batch->shape;
    set_sole(to, sole);
    to->x = batch->arrays.elements + 4 * f * shape->stride;
    to->y = to->x + shape->stride;
    to->begin = to->x + 2 * shape->stride;
    to->width = to->x + 3 * shape->stride;
}

/* values: [PLACES elements] to fill. places: where they will be on the device. */
static void set_shell(BodiesSole *to, const MildSole *sole, float *values, const float *places) {
    set_sole(to, sole);
    const int n = to->elements;
    const double square = mild_sole_pitch(sole) * mild_sole_pitch(sole);
    for (int i = 0; i < n; i++) {
        double p[3];
        element_at(sole, i, p);
        for (int k = 0; k < 3; k++) {
            values[k * n + i] = (float)p[k];
            values[(3 + k) * n + i] = (float)mild_sole_surface_normal(sole, k)[i];
        }
        values[6 * n + i] = (float)(mild_sole_surface_area(sole)[i] / square);
    }
    to->x = places;
    to->y = places + n;
    to->face = places + 2 * n;
    to->breadth = (float)mild_inside_heap(sole, 0).width;
}

/* [numbers] of the places of all shells. */
static size_t count_places(const MildSole *const *shell, int shells) {
    size_t numbers = 0;
    for (int s = 0; s < shells; s++) {
        numbers += PLACES * (size_t)mild_sole_elements(shell[s]);
    }
    return numbers;
}

static MildStatus set_shells(BatchBodies *bodies, BodiesSetup *setup, const MildBatch *batch,
                             const MildSole *const *shell, int shells, int worn, MildError *error) {
    const size_t numbers = count_places(shell, shells);
    float *values = malloc(numbers * sizeof *values);
    bodies->places = device_alloc(batch->device, numbers * sizeof *values, error);
    if (!values || !bodies->places) {
        free(values);
        return mild_fail(error, MILD_ERROR_MEMORY, "batch: out of memory");
    }
    size_t at = 0;
    for (int s = 0; s < shells; s++) {
        BodiesSole *to = &setup->sole[setup->feet + s];
        set_shell(to, shell[s], values + at, bodies->places + at);
        at += PLACES * (size_t)to->elements;
        to->memory = (int)bodies->numbers;
        bodies->numbers += (size_t)bodies_memory_numbers(to->elements, worn);
    }
    bodies->bytes += numbers * sizeof *values;
    MildStatus status =
        device_copy(batch->device, bodies->places, values, numbers * sizeof *values, error);
    free(values);
    return status;
}

/* Materials of the shells, in a setup. */
static void set_tables(BodiesSetup *setup, const MildBatch *batch, const MaterialNumbers *table) {
    const int shells = setup->bodies - setup->feet;
    for (int b = 0; b < setup->bodies; b++) {
        const MaterialNumbers *own =
            b < setup->feet ? batch->arrays.materials + b : table + (b - setup->feet);
        setup->sole[b].table = (const ContactMaterial *)(const void *)own;
        setup->sole[b].step = b < setup->feet ? setup->feet : shells;
    }
    setup->materials = batch->shape.materials;
}

static MildStatus set_all(BatchBodies *bodies, BodiesSetup *setup, const MildBatch *batch,
                          const MildSole *const *soles, int shells, int worn, MildError *error) {
    const size_t robots = (size_t)batch->shape.robots;
    for (int f = 0; f < setup->feet; f++) {
        set_foot(&setup->sole[f], batch, soles[f], f);
    }
    MildStatus status = set_shells(bodies, setup, batch, soles + setup->feet, shells, worn, error);
    if (status != MILD_OK) {
        return status;
    }
    set_tables(setup, batch, bodies->materials);
    bodies->bytes += sizeof *setup;
    bodies->setup = device_alloc(batch->device, sizeof *setup, error);
    bodies->memory = device_alloc(batch->device, robots * bodies->numbers * sizeof(float), error);
    if (!bodies->setup || !bodies->memory) {
        return MILD_ERROR_MEMORY;
    }
    return device_copy(batch->device, bodies->setup, setup, sizeof *setup, error);
}

MildStatus batch_bodies_open(BatchBodies *bodies, const MildBatch *batch,
                             const MildSole *const *soles, int shells, const MildMap *map,
                             const MildMaterial *materials, int count, int worn, MildError *error) {
    const BatchShape *shape = &batch->shape;
    BodiesSetup setup = {.feet = shape->feet,
                         .bodies = shape->feet + shells,
                         .dt = shape->dt,
                         .tolerance = shape->tolerance,
                         .limit = shape->limit,
                         .materials = shape->materials,
                         .steepest = (float)batch_map_steepest(map),
                         .has_map = shape->map,
                         .map = batch->arrays.map};
    *bodies = (BatchBodies){0};
    if (setup.bodies > BODIES_MAX) {
        return mild_fail(
            error, MILD_ERROR_RANGE,
            "batch: %d feet and %d bodies with shells; at most %d stand on soft ground",
            shape->feet, shells, BODIES_MAX);
    }
    int elements = 0;
    for (int b = 0; b < setup.bodies; b++) {
        elements += mild_sole_elements(soles[b]);
    }
    if (elements > BODIES_ELEMENTS) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "batch: the soles of a robot have %d elements, with shells at most %d: "
                         "take a larger spacing",
                         elements, BODIES_ELEMENTS);
    }
    double pitch[BODIES_MAX], width[BODIES_MAX];
    for (int s = 0; s < shells; s++) {
        pitch[s] = mild_sole_pitch(soles[shape->feet + s]);
        width[s] = mild_sole_width(soles[shape->feet + s]);
    }
    int curves = 0;
    bodies->materials =
        material_table(batch->device, pitch, width, shells, materials, count, &curves, error);
    bodies->bytes += (size_t)((count + 1) * shells) * sizeof *bodies->materials;
    return bodies->materials ? set_all(bodies, &setup, batch, soles, shells, worn, error)
                             : error->status;
}

void batch_bodies_close(const BatchBodies *bodies, int device) {
    device_free(device, bodies->setup);
    device_free(device, bodies->memory);
    device_free(device, bodies->places);
    device_free(device, bodies->materials);
    device_free(device, bodies->near);
}

/* ---- of a batch that steps them itself ---- */

MildStatus batch_bodies_ready(MildBatch *batch, MildError *error) {
    BatchBodies *bodies = &batch->bodies;
    const size_t robots = (size_t)batch->shape.robots;
    bodies->near = device_alloc(batch->device, robots * sizeof *bodies->near, error);
    batch->arrays.skip = bodies->near;
    return bodies->near ? MILD_OK : MILD_ERROR_MEMORY;
}

/* The setup comes from the device, is changed, and goes back when no step reads it. */
static MildStatus get_setup(const MildBatch *batch, BodiesSetup *setup, MildError *error) {
    MildStatus status = device_wait(batch->device, error);
    return status == MILD_OK
               ? device_copy(batch->device, setup, batch->bodies.setup, sizeof *setup, error)
               : status;
}

static MildStatus put_setup(const MildBatch *batch, const BodiesSetup *setup, MildError *error) {
    return device_copy(batch->device, batch->bodies.setup, setup, sizeof *setup, error);
}

MildStatus batch_bodies_set_materials(MildBatch *batch, const MildMaterial *materials, int count,
                                      MildError *error) {
    const int feet = batch->shape.feet;
    BodiesSetup setup = {.feet = 0};
    MaterialNumbers *table =
        material_table(batch->device, batch->pitch + feet, batch->width + feet,
                       batch->shape.soles - feet, materials, count, &batch->curves, error);
    MildStatus status = table ? get_setup(batch, &setup, error) : error->status;
    if (status == MILD_OK) {
        set_tables(&setup, batch, table);
        status = put_setup(batch, &setup, error);
    }
    device_free(batch->device, status == MILD_OK ? batch->bodies.materials : table);
    batch->bodies.materials = status == MILD_OK ? table : batch->bodies.materials;
    return status;
}

MildStatus batch_bodies_set_map(MildBatch *batch, double steepest, MildError *error) {
    BatchBodies *bodies = &batch->bodies;
    const size_t numbers = (size_t)batch->shape.robots * bodies->numbers;
    BodiesSetup setup;
    float *memory = device_alloc(batch->device, numbers * sizeof *memory, error);
    MildStatus status = memory ? get_setup(batch, &setup, error) : error->status;
    if (status == MILD_OK) {
        setup.has_map = batch->shape.map;
        setup.map = batch->arrays.map;
        setup.steepest = (float)steepest;
        status = put_setup(batch, &setup, error);
    }
    device_free(batch->device, status == MILD_OK ? bodies->memory : memory);
    bodies->memory = status == MILD_OK ? memory : bodies->memory;
    return status;
}

void batch_bodies_reset(const BatchBodies *bodies, size_t robot) {
    if (bodies->setup) {
        memset(bodies->memory + robot * bodies->numbers, 0, bodies->numbers * sizeof(float));
    }
}

int batch_bodies_curves(const MildBatch *batch) {
    const int bits = batch->curves & ~LAW_CREATES; /* the kernels for cones know it, too */
    return !(bits & ~LAW_CONE) ? LAW_CONE : bits & LAW_HEAP ? LAW_ANY : LAW_ALL;
}

static BodiesCall call_of(const MildBatch *batch, const MildBatchInput *input,
                          const MildBatchOutput *output, int advance) {
    return (BodiesCall){.shape = batch->shape,
                        .arrays = batch->arrays,
                        .bodies = batch->bodies,
                        .input = *input,
                        .output = *output,
                        .advance = advance,
                        .curves = batch_bodies_curves(batch)};
}

MildStatus batch_bodies_begin(const MildBatch *batch, const MildBatchInput *input,
                              const MildBatchOutput *output, int advance, MildStream stream,
                              MildError *error) {
    const BodiesCall call = call_of(batch, input, output, advance);
    if (batch->device != MILD_BATCH_HOST) {
        return gpu_bodies_begin(&call, batch->device, stream, error);
    }
    host_bodies_begin(&call);
    return MILD_OK;
}

MildStatus batch_bodies_end(const MildBatch *batch, const MildBatchInput *input,
                            const MildBatchOutput *output, int advance, MildStream stream,
                            MildError *error) {
    const BodiesCall call = call_of(batch, input, output, advance);
    if (batch->device != MILD_BATCH_HOST) {
        return gpu_bodies_end(&call, batch->device, stream, error);
    }
    host_bodies_end(&call);
    return MILD_OK;
}

/* ---- what the ground under the shells of a batch remembers, from and to mild/ground.h ---- */

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
