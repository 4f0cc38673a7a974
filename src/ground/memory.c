#include <string.h>

#include "ground/prints.h"

#define MEMORY_BAND 1e-5 /* [m] horizontal motion below this is jitter, not drift */
#define MEMORY_CAP 0.1   /* [m] longest drift that still hardens the ground */
#define MEMORY_DOUBLES 9

static int32_t padded_elements(const MildSole *sole) {
    return (int32_t)((mild_sole_elements(sole) + CONTACT_LANES - 1) / CONTACT_LANES * CONTACT_LANES);
}

static size_t foot_bytes(int32_t padded) {
    return ((size_t)padded * (MEMORY_DOUBLES * sizeof(double) + sizeof(int32_t)) + 63) / 64 * 64;
}

static size_t feet_bytes(const int32_t *padded, int feet) {
    size_t bytes = 0;
    for (int f = 0; f < feet; f++) bytes += foot_bytes(padded[f]);
    return bytes;
}

size_t mild_ground_bytes_prints(const MildSole *const *soles, int feet, int tiles) {
    int32_t padded[MILD_FEET_MAX];
    for (int f = 0; f < feet; f++) padded[f] = padded_elements(soles[f]);
    return sizeof(MildGround) + feet_bytes(padded, feet) + (prints_bytes(prints_round(tiles)) + 63) / 64 * 64;
}

size_t mild_ground_bytes(const MildSole *const *soles, int feet) {
    return mild_ground_bytes_prints(soles, feet, 0);
}

size_t mild_ground_size(const MildGround *ground) {
    return sizeof(MildGround) + feet_bytes(ground->padded, ground->feet) + (prints_bytes(ground->tiles) + 63) / 64 * 64;
}

Memory ground_memory(const MildGround *ground, int foot) {
    /* The one place where the block is seen as arrays; callers of a const ground only read through it. */
    double *at = (double *)((uintptr_t)ground + sizeof(MildGround) + feet_bytes(ground->padded, foot));
    size_t n = (size_t)ground->padded[foot];
    return (Memory){at,         at + n,     at + 2 * n, at + 3 * n, at + 4 * n,
                    at + 5 * n, at + 6 * n, at + 7 * n, at + 8 * n, (int32_t *)(at + MEMORY_DOUBLES * n)};
}

/* Behind the feet; read as ground_memory is. */
Prints ground_prints(const MildGround *ground) {
    PrintKey *keys = (PrintKey *)((uintptr_t)ground + sizeof(MildGround) + feet_bytes(ground->padded, ground->feet));
    return (Prints){keys, (uint16_t *)(keys + ground->tiles), ground->tiles, 1.0 / ground->print_cell, ground->print_time};
}

MildGround *mild_ground_init_prints(void *block, const MildSole *const *soles, int feet, int tiles) {
    memset(block, 0, mild_ground_bytes_prints(soles, feet, tiles));
    MildGround *ground = block;
    ground->feet = feet;
    for (int f = 0; f < feet; f++) {
        ground->elements[f] = mild_sole_elements(soles[f]);
        ground->padded[f] = padded_elements(soles[f]);
    }
    ground->tiles = prints_round(tiles);
    ground->print_cell = 0.5 * mild_sole_pitch(soles[0]);
    mild_ground_reset(ground);
    return ground;
}

MildGround *mild_ground_init(void *block, const MildSole *const *soles, int feet) {
    return mild_ground_init_prints(block, soles, feet, 0);
}

static void foot_forget(MildGround *ground, int foot) {
    Memory memory = ground_memory(ground, foot);
    size_t n = (size_t)ground->padded[foot];
    memset(memory.depth_max, 0, MEMORY_DOUBLES * n * sizeof(double));
    for (size_t i = 0; i < n; i++) memory.material[i] = MATERIAL_NONE;
    ground->touched[foot] = 0;
}

void mild_ground_reset(MildGround *ground) {
    for (int f = 0; f < ground->feet; f++) foot_forget(ground, f);
    Prints prints = ground_prints(ground);
    prints_clear(&prints);
    ground->print_time = 0;
}

const double *mild_ground_depth_max(const MildGround *ground, int foot) {
    return ground_memory(ground, foot).depth_max;
}

static void element_forget(const Memory *memory, int e, int32_t material, double middle) {
    memory->depth_max[e] = 0.0;
    memory->middle[e] = middle;
    memory->front_speed[e] = 0.0;
    memory->drift[e] = 0.0;
    memory->pending_x[e] = 0.0;
    memory->pending_y[e] = 0.0;
    memory->material[e] = material;
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

/* The elements of a foot in one step. */
typedef struct {
    const FootScratch *foot;
    const Slots *slot;
    const Prints *prints; /* NULL: lifted ground forgets */
    const double *rotation, *V;
    double dt, height; /* height: of the terrain, its map aside */
} Advance;

/* Lifted off: out of the ground; where prints stay, as soon as its own print no longer presses on it. */
static int element_lifted(const Advance *a, int i, double m1) {
    const Slots *s = a->slot;
    if (!(m1 > 0.0)) return 1;
    return a->prints && s->recovery[i] < 1.0 && m1 <= s->slack[i];
}

/* What an element that carried something leaves behind, where it lifts off and in each cell that it slides out of; sliding
 * into a deeper print it takes over that depth. A greater depth never means more force, so this gives no energy. */
static void element_print(const Advance *a, const Memory *memory, int i, int e, int lifted) {
    const Slots *s = a->slot;
    if (!(s->recovery[i] < 1.0)) return;
    double x0 = a->foot->point_x[e], y0 = a->foot->point_y[e];
    double x1 = x0 + a->dt * (a->V[0] + a->V[4] * s->pz[i] - a->V[5] * s->py[i]);
    double y1 = y0 + a->dt * (a->V[1] + a->V[5] * s->px[i] - a->V[3] * s->pz[i]);
    if (!lifted && prints_same_cell(a->prints, x0, y0, x1, y1)) return;
    prints_press(a->prints, &(PrintElement){x0, y0, a->foot->pitch, a->rotation}, lifted ? s->deep[i] : memory->depth_max[e]);
    if (lifted) return;
    double found = prints_read(a->prints, &(PrintElement){x1, y1, a->foot->pitch, a->rotation});
    if (found <= memory->depth_max[e]) return;
    memory->depth_max[e] = found;
    memory->front_speed[e] = 0.0;
}

/* How deep the element has been in this step. A foot that turns round within it was deepest between its ends: elastic ground
 * took it to the top of the parabola through them. */
static double element_peak(const Slots *s, int i, double dt, double w, double m1) {
    double w0 = s->speed[i], m0 = s->middle[i];
    if (!(w < 0.0 && w0 > 0.0)) return m1;
    double top = m0 + 0.5 * dt * w0 * w0 / (w0 - w);
    return m1 + s->recovery[i] * fmax(top - m1, 0.0);
}

static void element_advance(const Advance *a, const Memory *memory, int i, int e, int32_t material, double w, double m1) {
    const Slots *s = a->slot;
    const double *V = a->V;
    int leads = m1 > s->front[i] && w > s->reach[i], joined = s->front_speed[i] > s->reach[i] || !(s->depth_max[i] > 0.0);
    /* The added mass joins with the speed gained beyond the old front; the rest is an impact in the next step. */
    memory->front_speed[e] = leads ? (joined ? w : w - s->reach[i]) : 0.0;
    memory->depth_max[e] = s->deep[i] + fmax(element_peak(s, i, a->dt, w, m1) - s->front[i], 0.0);
    memory->middle[e] = fmin(m1, memory->depth_max[e]);
    memory->material[e] = material;
    element_drift(memory, e, a->dt * (V[0] + V[4] * s->pz[i] - V[5] * s->py[i]),
                  a->dt * (V[1] + V[5] * s->px[i] - V[3] * s->pz[i]));
}

/* The tangent plane that the step took the ground for, through the depth it took for the element's. */
static void element_plane(const Advance *a, const Memory *memory, int i, int e) {
    const Slots *s = a->slot;
    const FootScratch *foot = a->foot;
    memory->slope_x[e] = s->slope_x[i];
    memory->slope_y[e] = s->slope_y[i];
    memory->plane[e] = s->depth[i] - s->slope_x[i] * foot->point_x[e] - s->slope_y[i] * foot->point_y[e] +
                       foot->point_z[e] - a->height;
}

static int foot_advance(const Advance *a, const Memory *memory, const int32_t *material) {
    const FootScratch *foot = a->foot;
    int32_t lifted_material = a->prints || foot->uneven ? MATERIAL_FREE : MATERIAL_NONE;
    int next = 0, touched = 0;
    for (int k = 0; k < foot->active; k++, next++) {
        int i = foot->start + k, e = foot->element[k];
        for (; next < e; next++) element_forget(memory, next, MATERIAL_NONE, 0.0);
        double w = slot_descent(a->slot, i, a->V), m1 = a->slot->depth[i] + 0.5 * a->dt * w;
        int lifted = element_lifted(a, i, m1), carried = memory->material[e] >= 0;
        if (lifted)
            element_forget(memory, e, lifted_material, m1);
        else
            element_advance(a, memory, i, e, material[i], w, m1);
        if (a->prints && (carried || !lifted)) element_print(a, memory, i, e, lifted);
        if (foot->uneven) element_plane(a, memory, i, e);
        touched += !lifted || lifted_material != MATERIAL_NONE;
    }
    for (; next < foot->elements; next++) element_forget(memory, next, MATERIAL_NONE, 0.0);
    return touched;
}

void mild_ground_advance(MildGround *ground, const MildTerrain *terrain, const MildContactInput *input,
                         const MildScratch *scratch, const MildContactResult *result) {
    if (ground->tiles > 0 && ++ground->print_time == 0) ground->print_time = 1; /* 0 marks an empty tile */
    Prints prints = ground_prints(ground);
    for (int f = 0; f < ground->feet; f++) {
        const FootScratch *foot = &scratch->foot[f];
        ground->uneven[f] = foot->uneven;
        if (ground->touched[f] == 0 && foot->active == 0) continue;
        Memory memory = ground_memory(ground, f);
        Advance advance = {foot,      &scratch->slot,  ground->tiles > 0 ? &prints : NULL, input->rotation[f],
                           result->velocity + 6 * f, input->dt,       terrain->height};
        ground->touched[f] = foot_advance(&advance, &memory, scratch->slot_material);
    }
}
