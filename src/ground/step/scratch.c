#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include <stdlib.h>
#include <string.h>

#include "ground/sole/sole.h"
#include "ground/step/scratch.h"

/* Number of arrays of FootScratch outside the slots: x, y, depth, slope_x, slope_y, point_x,
 * point_y, point_z, normal, tangent_x, tangent_y and flat; state and slip share the next; heap has
 * two. */
#define FOOT_ARRAYS 15
#define SHELL_ARRAYS 6 /* more of a shell: height, face[3], area and area_share */

/* Numbers of a foot in the block. */
static size_t foot_doubles(const MildSole *sole) {
    return (size_t)sole_padded(sole) *
           (SLOT_NUMBERS + FOOT_ARRAYS + (sole->shell ? SHELL_ARRAYS : 0));
}

/* Takes the next `count` numbers of the block. */
static double *take(double **at, int count) {
    double *taken = *at;
    *at += count;
    return taken;
}

/* Sets the numbers of the sole and takes the arrays outside the slots. */
static void foot_set(FootScratch *foot, const MildSole *sole, double **at) {
    foot->elements = mild_sole_elements(sole);
    foot->padded = sole_padded(sole);
    foot->z = mild_sole_z(sole);
    foot->pitch = mild_sole_pitch(sole);
    foot->width = mild_sole_width(sole);
    double *x = take(at, foot->padded);
    double *y = take(at, foot->padded);
    memcpy(x, mild_sole_x(sole), (size_t)foot->elements * sizeof *x);
    memcpy(y, mild_sole_y(sole), (size_t)foot->elements * sizeof *y);
    for (int i = 0; i < foot->elements; i++) {
        foot->center_x += x[i] / foot->elements;
        foot->center_y += y[i] / foot->elements;
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
    foot->heap = (SoleHeap *)take(at, 2 * foot->padded);
    for (int i = 0; i < foot->elements; i++) {
        foot->heap[i] = sole_heap(sole, i);
    }
}

/* Takes and fills the arrays of a shell. */
static void foot_set_faces(FootScratch *foot, const MildSole *sole, double **at) {
    if (!sole->shell) {
        return;
    }
    foot->shell = SLOT_SHELL;
    foot->height = take(at, foot->padded);
    foot->area = take(at, foot->padded);
    foot->area_share = take(at, foot->padded);
    for (int k = 0; k < 3; k++) {
        foot->face[k] = take(at, foot->padded);
        memcpy(foot->face[k], mild_sole_surface_normal(sole, k),
               (size_t)foot->elements * sizeof(double));
    }
    for (int i = 0; i < foot->elements; i++) {
        foot->height[i] = mild_sole_surface_z(sole)[i] - foot->z;
        foot->area[i] = mild_sole_surface_area(sole)[i] / (foot->pitch * foot->pitch);
    }
}

/* Bounding box and radius. */
static void foot_set_bounds(FootScratch *foot) {
    double low[3] = {INFINITY, INFINITY, INFINITY};
    double high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (int i = 0; i < foot->elements; i++) {
        const double p[3] = {foot->x[i], foot->y[i],
                             foot->z + (foot->shell ? foot->height[i] : 0.0)};
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], p[k]);
            high[k] = fmax(high[k], p[k]);
        }
        foot->radius = fmax(foot->radius, sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]));
    }
    for (int k = 0; k < 3; k++) {
        foot->middle[k] = 0.5 * (low[k] + high[k]);
        foot->half[k] = 0.5 * (high[k] - low[k]);
    }
}

/* Takes the slots. None has a law yet. */
static void foot_set_slots(FootScratch *foot, double **at, int32_t *integers) {
    foot->slot = (Slots *)take(at, (int)SLOT_NUMBERS * foot->padded);
    foot->element = integers;
    const int slots = SLOTS_PADDED(foot->padded);
    foot->slot_material = integers + slots;
    foot->slot_holder = integers + 2 * slots;
    for (int i = 0; i < slots; i++) {
        foot->slot_material[i] = MATERIAL_NONE;
        foot->slot_holder[i] = -1;
    }
}

int scratch_fits(const MildScratch *scratch, const MildGround *ground) {
    int fits = scratch->feet == ground->feet && scratch->shells == ground->shells;
    for (int f = 0; f < ground->feet; f++) {
        fits = fits && scratch->foot[f].elements == ground->elements[f];
    }
    return fits;
}

MildScratch *mild_scratch_create(const MildSole *const *soles, int feet, MildError *error) {
    if (feet < 1 || feet > MILD_FEET_MAX) {
        mild_fail(error, MILD_ERROR_RANGE, "feet = %d is outside 1 .. %d", feet, MILD_FEET_MAX);
        return NULL;
    }
    int slots = 0;
    size_t doubles = 0;
    for (int f = 0; f < feet; f++) {
        slots += SLOTS_PADDED(sole_padded(soles[f]));
        doubles += foot_doubles(soles[f]);
    }
    const size_t rows = 2 * 6 * (size_t)feet * ROW_LANES;
    doubles += rows;
    const size_t used = doubles * sizeof(double) + 3 * (size_t)slots * sizeof(int32_t);
    const size_t bytes = (used + 63) / 64 * 64;
    MildScratch *scratch = calloc(1, sizeof *scratch + (size_t)feet * sizeof(FootScratch));
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
    scratch->rows = block;
    scratch->window[ROW_LANES] = 1.0;
    double *at = block + rows;
    int32_t *integers = (int32_t *)(block + doubles);
    for (int f = 0; f < feet; f++) {
        FootScratch *foot = &scratch->foot[f];
        foot_set(foot, soles[f], &at);
        foot_set_faces(foot, soles[f], &at);
        foot_set_bounds(foot);
        scratch->shells |= soles[f]->shell << f;
        foot_set_slots(foot, &at, integers);
        integers += 3 * SLOTS_PADDED(foot->padded);
    }
    return scratch;
}

void mild_scratch_destroy(MildScratch *scratch) {
    if (!scratch) {
        return;
    }
    free(scratch->block);
    free(scratch);
}

void foot_points(const FootScratch *foot) {
    const double *x = foot->x;
    const double *y = foot->y;
    const double *o = foot->origin;
    const double ox = o[0] + foot->arm[0][0];
    const double oy = o[1] + foot->arm[0][1];
    const double oz = o[2] + foot->arm[0][2];
    const double ex = foot->arm[1][0];
    const double ey = foot->arm[1][1];
    const double ez = foot->arm[1][2];
    const double nx = foot->arm[2][0];
    const double ny = foot->arm[2][1];
    const double nz = foot->arm[2][2];
    const int end = foot->padded & -VECTOR_LANES; /* changes nothing; no loop for a remainder */
#pragma omp simd
    for (int i = 0; i < end; i++) {
        foot->point_x[i] = ox + ex * x[i] + nx * y[i];
        foot->point_y[i] = oy + ey * x[i] + ny * y[i];
        foot->point_z[i] = oz + ez * x[i] + nz * y[i];
    }
    for (int i = 0; foot->shell && i < foot->padded; i++) {
        foot->point_x[i] += foot->arm[3][0] * foot->height[i];
        foot->point_y[i] += foot->arm[3][1] * foot->height[i];
        foot->point_z[i] += foot->arm[3][2] * foot->height[i];
    }
}
