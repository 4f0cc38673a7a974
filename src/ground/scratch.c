#include <stdlib.h>
#include <string.h>

#include "ground/contact.h"

#define FOOT_ARRAYS 11 /* depth, normal, tangent x y, point x y z, flat, slope x y; state and slip share one */

static int padded(const MildSole *sole) {
    return (mild_sole_elements(sole) + CONTACT_LANES - 1) / CONTACT_LANES * CONTACT_LANES;
}

static double *take(double **at, int count) {
    double *taken = *at;
    *at += count;
    return taken;
}

static void foot_set(FootScratch *foot, const MildSole *sole, double **at, int32_t *element) {
    foot->elements = mild_sole_elements(sole);
    foot->padded = padded(sole);
    foot->z = mild_sole_z(sole);
    foot->pitch = mild_sole_pitch(sole);
    double *x = take(at, foot->padded), *y = take(at, foot->padded);
    memcpy(x, mild_sole_x(sole), (size_t)foot->elements * sizeof *x);
    memcpy(y, mild_sole_y(sole), (size_t)foot->elements * sizeof *y);
    for (int i = 0; i < foot->elements; i++) {
        foot->center_x += x[i] / foot->elements;
        foot->center_y += y[i] / foot->elements;
        foot->radius = fmax(foot->radius, sqrt(x[i] * x[i] + y[i] * y[i] + foot->z * foot->z));
    }
    foot->x = x;
    foot->y = y;
    foot->depth = take(at, foot->padded);
    foot->normal = take(at, foot->padded);
    foot->tangent_x = take(at, foot->padded);
    foot->tangent_y = take(at, foot->padded);
    foot->point_x = take(at, foot->padded);
    foot->point_y = take(at, foot->padded);
    foot->point_z = take(at, foot->padded);
    foot->flat = take(at, foot->padded);
    foot->slope_x = take(at, foot->padded);
    foot->slope_y = take(at, foot->padded);
    foot->state = (uint8_t *)take(at, foot->padded);
    foot->slip = foot->state + foot->padded;
    foot->element = element;
}

MildScratch *mild_scratch_create(const MildSole *const *soles, int feet, MildError *error) {
    if (feet < 1 || feet > MILD_FEET_MAX) {
        mild_fail(error, MILD_ERROR_RANGE, "feet = %d is outside 1 .. %d", feet, MILD_FEET_MAX);
        return NULL;
    }
    int slots = 0;
    for (int f = 0; f < feet; f++) slots += padded(soles[f]);
    size_t doubles = (size_t)slots * (SLOT_ARRAYS + FOOT_ARRAYS + 2), bytes = doubles * sizeof(double);
    bytes = (bytes + 2 * (size_t)slots * sizeof(int32_t) + 63) / 64 * 64;
    MildScratch *scratch = calloc(1, sizeof *scratch);
    double *block = aligned_alloc(64, bytes);
    if (!scratch || !block) {
        free(scratch);
        free(block);
        mild_fail(error, MILD_ERROR_MEMORY, "contact: out of memory for %d elements", slots);
        return NULL;
    }
    memset(block, 0, bytes);
    scratch->feet = feet;
    scratch->block = block;
    double *at = block, **arrays[SLOT_ARRAYS];
    for (size_t k = 0; k < SLOT_ARRAYS; k++) {
        arrays[k] = (double **)&scratch->slot + k;
        *arrays[k] = take(&at, slots);
    }
    int32_t *integers = (int32_t *)(block + doubles);
    scratch->slot_material = integers;
    for (int i = 0; i < slots; i++) scratch->slot_material[i] = -1;
    int32_t *element = integers + slots;
    for (int f = 0; f < feet; f++) {
        foot_set(&scratch->foot[f], soles[f], &at, element);
        scratch->foot[f].start = (int)(element - integers) - slots;
        element += scratch->foot[f].padded;
    }
    return scratch;
}

void mild_scratch_destroy(MildScratch *scratch) {
    if (!scratch) return;
    free(scratch->block);
    free(scratch);
}
