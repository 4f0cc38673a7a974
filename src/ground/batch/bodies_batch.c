#define MILD_REAL_FLOAT
#include "ground/batch/bodies_batch.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "device/device.h"
#include "ground/batch/bodies.h"
#include "ground/inside.h"

_Static_assert(sizeof(ContactMaterial) == sizeof(MaterialNumbers), "the same numbers");

/* Arrays of a surface's elements: x, y and those of BodiesSole.face. */
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
    to->x = batch->arrays.elements + f * shape->stride;
    to->y = batch->arrays.elements + (shape->feet + f) * shape->stride;
    to->begin = batch->arrays.elements + (2 * shape->feet + f) * shape->stride;
    to->width = batch->arrays.elements + (3 * shape->feet + f) * shape->stride;
    to->table = (const ContactMaterial *)(const void *)(batch->arrays.materials + f);
    to->step = shape->feet;
}

/* values: [PLACES elements] to fill. places: where they will be on the device. */
static void set_surface(BodiesSole *to, const MildSole *sole, float *values, const float *places) {
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

/* [numbers] of the places of all surfaces. */
static size_t count_places(const MildSole *const *surface, int surfaces) {
    size_t numbers = 0;
    for (int s = 0; s < surfaces; s++) {
        numbers += PLACES * (size_t)mild_sole_elements(surface[s]);
    }
    return numbers;
}

static MildStatus set_surfaces(BatchBodies *bodies, BodiesSetup *setup, const MildBatch *batch,
                               const MildSole *const *surface, int surfaces, MildError *error) {
    const size_t numbers = count_places(surface, surfaces);
    float *values = malloc(numbers * sizeof *values);
    bodies->places = device_alloc(batch->device, numbers * sizeof *values, error);
    if (!values || !bodies->places) {
        free(values);
        return mild_fail(error, MILD_ERROR_MEMORY, "batch: out of memory");
    }
    size_t at = 0;
    for (int s = 0; s < surfaces; s++) {
        BodiesSole *to = &setup->sole[setup->feet + s];
        set_surface(to, surface[s], values + at, bodies->places + at);
        at += PLACES * (size_t)to->elements;
        to->table = (const ContactMaterial *)(const void *)(bodies->materials + s);
        to->step = surfaces;
        to->memory = (int)bodies->numbers;
        bodies->numbers += (size_t)bodies_memory_numbers(to->elements, batch->arrays.worn != NULL);
    }
    bodies->bytes += numbers * sizeof *values;
    MildStatus status =
        device_copy(batch->device, bodies->places, values, numbers * sizeof *values, error);
    free(values);
    return status;
}

/* The table of materials for the surfaces. */
static MildStatus set_materials(BatchBodies *bodies, const MildBatch *batch,
                                const MildSole *const *surface, int surfaces,
                                const MildMaterial *materials, int count, MildError *error) {
    const size_t bytes = (size_t)((count + 1) * surfaces) * sizeof(MaterialNumbers);
    MaterialNumbers *numbers = malloc(bytes);
    bodies->materials = device_alloc(batch->device, bytes, error);
    if (!numbers || !bodies->materials) {
        free(numbers);
        return mild_fail(error, MILD_ERROR_MEMORY, "batch: out of memory");
    }
    MildStatus status = MILD_OK;
    for (int i = 0; i < count * surfaces && status == MILD_OK; i++) {
        const MildSole *sole = surface[i % surfaces];
        status = material_numbers(&materials[i / surfaces], mild_sole_pitch(sole),
                                  mild_sole_width(sole), i / surfaces, &numbers[i], error);
    }
    memset(numbers + count * surfaces, 0xff, (size_t)surfaces * sizeof *numbers); /* no number */
    if (status == MILD_OK) {
        status = device_copy(batch->device, bodies->materials, numbers, bytes, error);
    }
    bodies->bytes += bytes;
    free(numbers);
    return status;
}

static MildStatus set_all(BatchBodies *bodies, BodiesSetup *setup, const MildBatch *batch,
                          const MildSole *const *soles, int surfaces, MildError *error) {
    const size_t robots = (size_t)batch->shape.robots;
    for (int f = 0; f < setup->feet; f++) {
        set_foot(&setup->sole[f], batch, soles[f], f);
    }
    MildStatus status = set_surfaces(bodies, setup, batch, soles + setup->feet, surfaces, error);
    if (status != MILD_OK) {
        return status;
    }
    bodies->bytes += sizeof *setup;
    bodies->setup = device_alloc(batch->device, sizeof *setup, error);
    bodies->memory = device_alloc(batch->device, robots * bodies->numbers * sizeof(float), error);
    if (!bodies->setup || !bodies->memory) {
        return MILD_ERROR_MEMORY;
    }
    return device_copy(batch->device, bodies->setup, setup, sizeof *setup, error);
}

MildStatus batch_bodies_open(BatchBodies *bodies, const MildBatch *batch,
                             const MildSole *const *soles, int surfaces, const MildMap *map,
                             const MildMaterial *materials, int count, MildError *error) {
    const BatchShape *shape = &batch->shape;
    BodiesSetup setup = {.feet = shape->feet,
                         .bodies = shape->feet + surfaces,
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
            shape->feet, surfaces, BODIES_MAX);
    }
    int elements = 0;
    for (int b = 0; b < setup.bodies; b++) {
        elements += mild_sole_elements(soles[b]);
    }
    if (elements > BODIES_ELEMENTS) {
        return mild_fail(error, MILD_ERROR_RANGE,
                         "batch: feet and shells have %d elements; at most %d stand on soft ground",
                         elements, BODIES_ELEMENTS);
    }
    MildStatus status =
        set_materials(bodies, batch, soles + shape->feet, surfaces, materials, count, error);
    return status == MILD_OK ? set_all(bodies, &setup, batch, soles, surfaces, error) : status;
}

void batch_bodies_close(const BatchBodies *bodies, int device) {
    device_free(device, bodies->setup);
    device_free(device, bodies->memory);
    device_free(device, bodies->places);
    device_free(device, bodies->materials);
}
