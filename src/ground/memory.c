#include <string.h>

#include "ground/contact.h"

#define MEMORY_BAND 1e-5 /* [m] horizontal motion below this is jitter, not drift */
#define MEMORY_CAP 0.1   /* [m] longest drift that still hardens the ground */
#define MEMORY_DOUBLES 5

static int32_t padded_elements(const MildSole *sole) {
    return (int32_t)((mild_sole_elements(sole) + CONTACT_LANES - 1) / CONTACT_LANES * CONTACT_LANES);
}

static size_t foot_bytes(int32_t padded) {
    return ((size_t)padded * (MEMORY_DOUBLES * sizeof(double) + sizeof(int32_t)) + 63) / 64 * 64;
}

size_t mild_ground_bytes(const MildSole *const *soles, int feet) {
    size_t bytes = sizeof(MildGround);
    for (int f = 0; f < feet; f++) bytes += foot_bytes(padded_elements(soles[f]));
    return bytes;
}

Memory ground_memory(const MildGround *ground, int foot) {
    size_t offset = sizeof(MildGround);
    for (int f = 0; f < foot; f++) offset += foot_bytes(ground->padded[f]);
    /* The one place where the block is seen as arrays; callers of a const ground only read through it. */
    double *values = (double *)((uintptr_t)ground + offset);
    size_t n = (size_t)ground->padded[foot];
    return (Memory){values, values + n, values + 2 * n, values + 3 * n, values + 4 * n, (int32_t *)(values + 5 * n)};
}

MildGround *mild_ground_init(void *block, const MildSole *const *soles, int feet) {
    memset(block, 0, mild_ground_bytes(soles, feet));
    MildGround *ground = block;
    ground->feet = feet;
    for (int f = 0; f < feet; f++) {
        ground->elements[f] = mild_sole_elements(soles[f]);
        ground->padded[f] = padded_elements(soles[f]);
    }
    mild_ground_reset(ground);
    return ground;
}

static void foot_forget(MildGround *ground, int foot) {
    Memory memory = ground_memory(ground, foot);
    size_t n = (size_t)ground->padded[foot];
    memset(memory.depth_max, 0, MEMORY_DOUBLES * n * sizeof(double));
    for (size_t i = 0; i < n; i++) memory.material[i] = -1;
    ground->touched[foot] = 0;
}

void mild_ground_reset(MildGround *ground) {
    for (int f = 0; f < ground->feet; f++) foot_forget(ground, f);
}

const double *mild_ground_depth_max(const MildGround *ground, int foot) {
    return ground_memory(ground, foot).depth_max;
}

static void element_forget(const Memory *memory, int e) {
    memory->depth_max[e] = 0.0;
    memory->front_speed[e] = 0.0;
    memory->drift[e] = 0.0;
    memory->pending_x[e] = 0.0;
    memory->pending_y[e] = 0.0;
    memory->material[e] = -1;
}

/* d_D is the length of the horizontal path (paper: accumulated, not end to end). Motion is collected until it leaves the
 * dead band, so that the count depends neither on the step size nor on jitter. */
static void element_drift(const Memory *memory, int e, double sx, double sy) {
    double x = memory->pending_x[e] + sx, y = memory->pending_y[e] + sy, square = x * x + y * y;
    int counts = square > MEMORY_BAND * MEMORY_BAND;
    if (counts) memory->drift[e] = fmin(memory->drift[e] + sqrt(square), MEMORY_CAP);
    memory->pending_x[e] = counts ? 0.0 : x;
    memory->pending_y[e] = counts ? 0.0 : y;
}

static int foot_advance(const Memory *memory, const MildScratch *scratch, int f, double dt, const double *V) {
    const FootScratch *foot = &scratch->foot[f];
    const Slots *s = &scratch->slot;
    int next = 0, touched = 0;
    for (int k = 0; k < foot->active; k++, next++) {
        int i = foot->start + k, e = foot->element[k];
        for (; next < e; next++) element_forget(memory, next);
        double w = -(V[2] + V[3] * s->py[i] - V[4] * s->px[i]), u1 = s->depth[i] + dt * w;
        if (!(u1 > 0.0)) {
            element_forget(memory, e);
            continue;
        }
        touched++;
        int leads = u1 > s->front[i] && w > s->reach[i];
        /* The added mass joins with the speed gained beyond the old front; the rest is an impact in the next step. */
        memory->front_speed[e] = leads ? (s->front_speed[i] > s->reach[i] || s->gap[i] > 0.0 ? w : w - s->reach[i]) : 0.0;
        memory->depth_max[e] = u1 + s->lead[i] > s->front[i] ? u1 + s->lead[i] : s->front[i];
        memory->material[e] = scratch->slot_material[i];
        element_drift(memory, e, dt * (V[0] + V[4] * s->pz[i] - V[5] * s->py[i]),
                      dt * (V[1] + V[5] * s->px[i] - V[3] * s->pz[i]));
    }
    for (; next < foot->elements; next++) element_forget(memory, next);
    return touched;
}

void mild_ground_advance(MildGround *ground, const MildTerrain *terrain, const MildContactInput *input,
                         const MildScratch *scratch, const MildContactResult *result) {
    (void)terrain; /* prints would move its surface */
    for (int f = 0; f < ground->feet; f++) {
        if (ground->touched[f] == 0 && scratch->foot[f].active == 0) continue;
        Memory memory = ground_memory(ground, f);
        ground->touched[f] = foot_advance(&memory, scratch, f, input->dt, result->velocity + 6 * f);
    }
}
