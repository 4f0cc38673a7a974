#include "ground/step/state.h"

#include <math.h>
#include <string.h>

#include "ground/law/element.h"
#include "ground/sole/sole.h"

#define MEMORY_DOUBLES 13 /* nine of ElementMemory, the wear, three of the plane */

_Static_assert(sizeof(ElementMemory) == 9 * sizeof(Real),
               "another number of ElementMemory also goes to Memory and here, to slots.h (Slots, "
               "slot_memory), locate.c, advance.c, and to batch/contact.inc (recall, "
               "record) and batch/memory.c");

int sole_padded(const MildSole *sole) {
    return (mild_sole_elements(sole) + VECTOR_LANES - 1) / VECTOR_LANES * VECTOR_LANES;
}

/* Arrays of numbers of a foot. A shell has one more. shells: MildGround.shells. */
static size_t foot_doubles(int32_t shells, int foot) {
    return MEMORY_DOUBLES + (size_t)(shells >> foot & 1);
}

static size_t feet_bytes(const MildGround *ground, int feet) {
    size_t bytes = 0;
    for (int f = 0; f < feet; f++) {
        const size_t element = foot_doubles(ground->shells, f) * sizeof(double) + sizeof(int32_t);
        bytes += ((size_t)ground->padded[f] * element + 63) / 64 * 64;
    }
    return bytes;
}

size_t mild_ground_bytes_imprints(const MildSole *const *soles, int feet, int tiles) {
    if (feet < 1 || feet > MILD_FEET_MAX) {
        return 0;
    }
    const MildGround layout = ground_layout(soles, feet, tiles);
    return mild_ground_size(&layout);
}

size_t mild_ground_bytes(const MildSole *const *soles, int feet) {
    return mild_ground_bytes_imprints(soles, feet, 0);
}

size_t mild_ground_size(const MildGround *ground) {
    return sizeof(MildGround) + feet_bytes(ground, ground->feet) +
           (imprints_bytes(ground->tiles) + 63) / 64 * 64;
}

Memory ground_memory(const MildGround *ground, int foot) {
    /* The only place that divides the block into arrays. Callers with a const ground must only read
     * through them. */
    double *at = (double *)((uintptr_t)ground + sizeof(MildGround) + feet_bytes(ground, foot));
    Memory memory;
    double **arrays[] = {&memory.depth_max, &memory.middle,    &memory.front_speed,
                         &memory.drift,     &memory.pending_x, &memory.pending_y,
                         &memory.held_x,    &memory.held_y,    &memory.held_stiffness,
                         &memory.worn,      &memory.plane,     &memory.slope_x,
                         &memory.slope_y};
    for (int k = 0; k < MEMORY_DOUBLES; k++, at += ground->padded[foot]) {
        *arrays[k] = at;
    }
    memory.area_share = NULL;
    if (ground->shells >> foot & 1) {
        memory.area_share = at;
        at += ground->padded[foot];
    }
    memory.material = (int32_t *)at;
    return memory;
}

Imprints ground_imprints(const MildGround *ground) {
    ImprintKey *keys =
        (ImprintKey *)((uintptr_t)ground + sizeof(MildGround) + feet_bytes(ground, ground->feet));
    return (Imprints){keys, (uint16_t *)(keys + ground->tiles), ground->tiles,
                      1.0 / ground->imprint_cell, ground->imprint_time};
}

MildGround ground_layout(const MildSole *const *soles, int feet, int tiles) {
    MildGround layout = {.feet = feet};
    for (int f = 0; f < feet; f++) {
        layout.elements[f] = mild_sole_elements(soles[f]);
        layout.padded[f] = sole_padded(soles[f]);
        layout.shells |= soles[f]->shell << f;
        layout.imprint_cell = fmax(layout.imprint_cell, 0.5 * mild_sole_pitch(soles[f]));
    }
    layout.tiles = imprints_round(tiles, MILD_IMPRINT_TILES_MAX);
    return layout;
}

MildGround *mild_ground_init_imprints(void *block, const MildSole *const *soles, int feet,
                                      int tiles) {
    const size_t bytes = mild_ground_bytes_imprints(soles, feet, tiles);
    if (!block || !bytes) {
        return NULL;
    }
    memset(block, 0, bytes);
    MildGround *ground = block;
    *ground = ground_layout(soles, feet, tiles);
    mild_ground_reset(ground);
    return ground;
}

MildGround *mild_ground_init(void *block, const MildSole *const *soles, int feet) {
    return mild_ground_init_imprints(block, soles, feet, 0);
}

static void foot_forget(MildGround *ground, int foot) {
    Memory memory = ground_memory(ground, foot);
    size_t n = (size_t)ground->padded[foot];
    memset(memory.depth_max, 0, foot_doubles(ground->shells, foot) * n * sizeof(double));
    for (size_t i = 0; i < n; i++) {
        memory.material[i] = MATERIAL_NONE;
    }
    ground->touched[foot] = 0;
    ground->uneven[foot] = 0;
}

void mild_ground_reset(MildGround *ground) {
    for (int f = 0; f < ground->feet; f++) {
        foot_forget(ground, f);
    }
    Imprints imprints = ground_imprints(ground);
    imprints_clear(&imprints);
    ground->imprint_time = 0;
}

const double *mild_ground_depth_max(const MildGround *ground, int foot) {
    return ground_memory(ground, foot).depth_max;
}

void memory_forget(const Memory *memory, int e, int32_t material) {
    memory->depth_max[e] = 0.0;
    memory->middle[e] = 0.0;
    memory->front_speed[e] = 0.0;
    memory->drift[e] = 0.0;
    memory->pending_x[e] = 0.0;
    memory->pending_y[e] = 0.0;
    memory->held_x[e] = 0.0;
    memory->held_y[e] = 0.0;
    memory->held_stiffness[e] = 0.0;
    memory->worn[e] = 0.0;
    memory->material[e] = material;
}

double mild_ground_imprint_at(const MildGround *ground, double x, double y) {
    Imprints imprints = ground_imprints(ground);
    return imprints_depth(&imprints, x, y);
}

/* Bool: an encoded material that a step can follow. shell: bool, of one. */
static int material_is_valid(int32_t material, int shell) {
    return material >= 0 ? (material & 0xff) < MILD_MATERIALS_MAX &&
                               (material >> 8 & 0xff) < MILD_MATERIALS_MAX && material >> 24 == 0
                         : material == MATERIAL_NONE || material == MATERIAL_FREE ||
                               (shell && material == MATERIAL_BURIED);
}

/* Bool: the memory of every element of a foot is finite, on materials that exist. */
static __attribute__((cold)) int foot_is_valid(const MildGround *ground, int foot) {
    const Memory memory = ground_memory(ground, foot);
    const size_t padded = (size_t)ground->padded[foot];
    int valid = ground->touched[foot] >= 0 && ground->touched[foot] <= ground->padded[foot];
    for (size_t i = 0; i < foot_doubles(ground->shells, foot) * padded; i++) {
        valid &= isfinite(memory.depth_max[i]) != 0;
    }
    for (size_t i = 0; i < padded; i++) {
        valid &= material_is_valid(memory.material[i], memory.area_share != NULL);
        valid &= !memory.area_share || memory.area_share[i] >= 0.0;
        valid &= memory.worn[i] >= 0.0 && memory.worn[i] < 1.0;
    }
    return valid;
}

/* Bool: the headers are those of grounds of the same soles and tiles. */
static int layouts_agree(const MildGround *a, const MildGround *b) {
    return a->feet == b->feet && memcmp(a->elements, b->elements, sizeof a->elements) == 0 &&
           memcmp(a->padded, b->padded, sizeof a->padded) == 0 && a->shells == b->shells &&
           a->tiles == b->tiles && a->imprint_cell == b->imprint_cell;
}

int ground_is_valid(const MildGround *ground, const MildGround *layout) {
    int valid = layouts_agree(ground, layout);
    for (int f = 0; valid && f < layout->feet; f++) {
        valid = foot_is_valid(ground, f);
    }
    return valid;
}

MildStatus mild_ground_restore(MildGround *ground, const void *block, size_t bytes,
                               MildError *error) {
    const MildGround *saved = block;
    if (bytes != mild_ground_size(ground)) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "state of %zu bytes; this ground has %zu: take that of a ground with the "
                         "same soles and tiles",
                         bytes, mild_ground_size(ground));
    }
    if (!ground_is_valid(saved, ground)) {
        return mild_fail(error, MILD_ERROR_FORMAT,
                         "state: these bytes are not the memory of a ground with these soles");
    }
    memcpy(ground, block, bytes);
    return MILD_OK;
}
