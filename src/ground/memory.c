#include <string.h>

#include "ground/prints.h"
#include "ground/step.h"

#define MEMORY_BAND 1e-5 /* [m] horizontal motion below this is jitter, not drift */
#define MEMORY_CAP 0.1   /* [m] longest drift that still hardens the ground */
#define MEMORY_DOUBLES 12

static int32_t padded_elements(const MildSole *sole) {
    return (int32_t)((mild_sole_elements(sole) + CONTACT_LANES - 1) / CONTACT_LANES *
                     CONTACT_LANES);
}

static size_t foot_bytes(int32_t padded) {
    return ((size_t)padded * (MEMORY_DOUBLES * sizeof(double) + sizeof(int32_t)) + 63) / 64 * 64;
}

static size_t feet_bytes(const int32_t *padded, int feet) {
    size_t bytes = 0;
    for (int f = 0; f < feet; f++) {
        bytes += foot_bytes(padded[f]);
    }
    return bytes;
}

size_t mild_ground_bytes_prints(const MildSole *const *soles, int feet, int tiles) {
    int32_t padded[MILD_FEET_MAX];
    for (int f = 0; f < feet; f++) {
        padded[f] = padded_elements(soles[f]);
    }
    return sizeof(MildGround) + feet_bytes(padded, feet) +
           (prints_bytes(prints_round(tiles)) + 63) / 64 * 64;
}

size_t mild_ground_bytes(const MildSole *const *soles, int feet) {
    return mild_ground_bytes_prints(soles, feet, 0);
}

size_t mild_ground_size(const MildGround *ground) {
    return sizeof(MildGround) + feet_bytes(ground->padded, ground->feet) +
           (prints_bytes(ground->tiles) + 63) / 64 * 64;
}

Memory ground_memory(const MildGround *ground, int foot) {
    /* The one place where the block is seen as arrays; callers of a const ground only read through
     * it. */
    double *at =
        (double *)((uintptr_t)ground + sizeof(MildGround) + feet_bytes(ground->padded, foot));
    Memory memory;
    double **arrays[] = {&memory.depth_max, &memory.middle,    &memory.front_speed,
                         &memory.drift,     &memory.pending_x, &memory.pending_y,
                         &memory.held_x,    &memory.held_y,    &memory.grip,
                         &memory.plane,     &memory.slope_x,   &memory.slope_y};
    for (int k = 0; k < MEMORY_DOUBLES; k++, at += ground->padded[foot]) {
        *arrays[k] = at;
    }
    memory.material = (int32_t *)at;
    return memory;
}

void slots_remember(Slots *s, const Memory *memory) {
    s->depth_max = memory->depth_max;
    s->remembered_middle = memory->middle;
    s->remembered_speed = memory->front_speed;
    s->drift = memory->drift;
    s->pending_x = memory->pending_x;
    s->pending_y = memory->pending_y;
    s->held_x = memory->held_x;
    s->held_y = memory->held_y;
    s->held_grip = memory->grip;
}

/* Behind the feet; read as ground_memory is. */
Prints ground_prints(const MildGround *ground) {
    PrintKey *keys = (PrintKey *)((uintptr_t)ground + sizeof(MildGround) +
                                  feet_bytes(ground->padded, ground->feet));
    return (Prints){keys, (uint16_t *)(keys + ground->tiles), ground->tiles,
                    1.0 / ground->print_cell, ground->print_time};
}

MildGround *mild_ground_init_prints(void *block, const MildSole *const *soles, int feet,
                                    int tiles) {
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
    for (size_t i = 0; i < n; i++) {
        memory.material[i] = MATERIAL_NONE;
    }
    ground->touched[foot] = 0;
}

void mild_ground_reset(MildGround *ground) {
    for (int f = 0; f < ground->feet; f++) {
        foot_forget(ground, f);
    }
    Prints prints = ground_prints(ground);
    prints_clear(&prints);
    ground->print_time = 0;
}

const double *mild_ground_depth_max(const MildGround *ground, int foot) {
    return ground_memory(ground, foot).depth_max;
}

static void element_forget(const Memory *memory, int e, int32_t material) {
    memory->depth_max[e] = 0.0;
    memory->middle[e] = 0.0;
    memory->front_speed[e] = 0.0;
    memory->drift[e] = 0.0;
    memory->pending_x[e] = 0.0;
    memory->pending_y[e] = 0.0;
    memory->held_x[e] = 0.0;
    memory->held_y[e] = 0.0;
    memory->grip[e] = 0.0;
    memory->material[e] = material;
}

/* The elements of a foot in one step. */
typedef struct {
    const FootScratch *foot;
    Slots slot;
    const Prints *prints; /* NULL: lifted ground forgets */
    const double *rotation;
    Motion motion;     /* after the step */
    double dt, height; /* height: of the terrain, its map aside */
} Advance;

/* Lifted off: out of the ground; where prints stay, as soon as its own print no longer presses on
 * it. */
static int element_lifted(const Advance *a, int i, double m1) {
    const Slots *s = &a->slot;
    if (!(m1 > 0.0)) {
        return 1;
    }
    return a->prints && s->recovery[i] < 1.0 && m1 <= s->slack[i];
}

/* What an element that carried something leaves behind, where it lifts off and in each cell that it
 * slides out of; sliding into a deeper print it takes over that depth. A greater depth never means
 * more force, so this gives no energy. */
static void element_print(const Advance *a, const Memory *memory, int i, int e, int lifted) {
    const Slots *s = &a->slot;
    if (!(s->recovery[i] < 1.0)) {
        return;
    }
    double x0 = a->foot->point_x[e], y0 = a->foot->point_y[e];
    double x1 = x0 + a->dt * motion_at(a->motion.x, s->x[i], s->y[i]);
    double y1 = y0 + a->dt * motion_at(a->motion.y, s->x[i], s->y[i]);
    if (!lifted && prints_same_cell(a->prints, x0, y0, x1, y1)) {
        return;
    }
    prints_press(a->prints, &(PrintElement){x0, y0, a->foot->pitch, a->rotation},
                 lifted ? s->deep[i] : memory->depth_max[e]);
    if (lifted) {
        return;
    }
    double found = prints_read(a->prints, &(PrintElement){x1, y1, a->foot->pitch, a->rotation});
    if (found <= memory->depth_max[e]) {
        return;
    }
    memory->depth_max[e] = found;
    memory->front_speed[e] = 0.0;
}

/* The memory of an element that stays in the ground, or forgets. Branch-free, so that it runs in
 * vectors; chosen, not multiplied by 0, which would keep what is not a number. */
ALWAYS_INLINE void element_advance(const Slots *s, const Memory *memory, int i, int e, double dt,
                                   double rate, double vx, double vy, double w, double m1,
                                   double stays) {
    double front = s->front[i], reach = s->reach[i],
           depth_max = s->deep[i] + step_max(m1 - front, 0.0);
    /* The added mass joins with the speed gained beyond the old front; the rest is an impact in the
     * next step. */
    double before = s->front_speed[i] > reach || !(s->depth_max[i] > 0.0) ? 0.0 : reach,
           speed = w - before;
    double leads = m1 > front && w > reach ? stays : 0.0;
    memory->depth_max[e] = stays > 0.0 ? depth_max : 0.0;
    memory->middle[e] = step_min(m1, stays > 0.0 ? depth_max : m1);
    memory->front_speed[e] = leads > 0.0 ? speed : 0.0;
    /* Drift: motion is collected until it leaves the dead band, so that the count depends neither
     * on the step size nor on jitter. d_D is the length of the path (paper: accumulated, not end to
     * end). */
    double x = s->pending_x[i] + dt * vx, y = s->pending_y[i] + dt * vy, square = x * x + y * y;
    double counts = square > MEMORY_BAND * MEMORY_BAND ? 1.0 : 0.0, pends = stays * (1.0 - counts);
    double drift = step_min(s->drift[i] + counts * sqrt(square), MEMORY_CAP);
    memory->drift[e] = stays > 0.0 ? drift : 0.0;
    memory->pending_x[e] = pends > 0.0 ? x : 0.0;
    memory->pending_y[e] = pends > 0.0 ? y : 0.0;
    /* What stays held when the element rests, see friction.h. */
    double held_x = s->hold_x[i] - s->grip[i] * vx, held_y = s->hold_y[i] - s->grip[i] * vy;
    double bound = s->mu[i] * s->iz[i] + s->drift_radius[i],
           held = sqrt(held_x * held_x + held_y * held_y);
    double share = rate * (held > bound ? bound / held : 1.0), grip = rate * rate * s->grip[i];
    memory->held_x[e] = stays > 0.0 ? share * held_x : 0.0;
    memory->held_y[e] = stays > 0.0 ? share * held_y : 0.0;
    memory->grip[e] = stays > 0.0 ? grip : 0.0;
}

/* An element that turned round within the step has been deeper. */
static void element_peak(const Slots *s, const Memory *memory, int i, int e, double w, double m1) {
    memory->depth_max[e] =
        fmax(memory->depth_max[e], s->deep[i] + step_peak(s, i, w, m1) - s->front[i]);
}

/* The same for all elements of a foot. Kept apart: addresses that others get to know do not stay in
 * registers. */
static void foot_peaks(const Advance *a, const Memory *memory) {
    const Slots *s = &a->slot;
    for (int i = 0; i < a->foot->elements; i++) {
        double w = slot_descent(s, i, &a->motion), m1 = s->depth[i] + 0.5 * a->dt * w;
        if (m1 > 0.0) {
            element_peak(s, memory, i, i, w, m1);
        }
    }
}

/* The tangent plane that the step took the ground for, through the depth it took for the element's.
 */
ALWAYS_INLINE void element_plane(const FootScratch *foot, double height, const Slots *s,
                                 const Memory *memory, int i, int e) {
    double slope_x = s->slope_x[i], slope_y = s->slope_y[i];
    memory->slope_x[e] = slope_x;
    memory->slope_y[e] = slope_y;
    memory->plane[e] = s->depth[i] - slope_x * foot->point_x[e] - slope_y * foot->point_y[e] +
                       foot->point_z[e] - height;
}

/* All elements are listed, on ground without prints. Returns how many stay in the ground. */
ALWAYS_INLINE int foot_advance_all(const Advance *a, const Memory *all, const int32_t *material,
                                   int uneven) {
    const FootScratch foot = *a->foot;
    const Slots local = a->slot, *s = &local;
    const Memory own = *all, *memory = &own;
    const Motion m = a->motion;
    double dt = a->dt, rate = 1.0 / dt, height = a->height, touched = 0.0, turned = 0.0;
    int end = foot.padded;
#pragma omp simd reduction(+ : touched, turned)
    for (int i = 0; i < end; i++) {
        double x = s->x[i], y = s->y[i], vx = m.x[0] + m.x[1] * x + m.x[2] * y,
               vy = m.y[0] + m.y[1] * x + m.y[2] * y;
        double w = -(m.z[0] + m.z[1] * x + m.z[2] * y);
        if (uneven) {
            w += s->slope_x[i] * vx + s->slope_y[i] * vy;
        }
        double m1 = s->depth[i] + 0.5 * dt * w, stays = m1 > 0.0 ? 1.0 : 0.0;
        element_advance(s, memory, i, i, dt, rate, vx, vy, w, m1, stays);
        if (uneven) {
            element_plane(&foot, height, s, memory, i, i);
        }
        touched += stays;
        turned += step_turns(s->speed[i], w) ? stays : 0.0;
    }
    if (turned > 0.0) {
        foot_peaks(a, all);
    }
    for (int i = foot.elements; i < end; i++) {
        element_forget(memory, i, MATERIAL_NONE); /* the padding */
    }
    const double *depth_max = memory->depth_max;
    int32_t *remembered = memory->material, lifted = uneven ? MATERIAL_FREE : MATERIAL_NONE;
    for (int i = 0; i < end; i++) {
        remembered[i] = depth_max[i] > 0.0 ? material[i] : lifted;
    }
    return uneven ? foot.elements : (int)touched;
}

static int foot_advance(const Advance *a, const Memory *memory, const int32_t *material) {
    const FootScratch *foot = a->foot;
    const Slots *s = &a->slot;
    const Motion *m = &a->motion;
    int32_t lifted_material = a->prints || foot->uneven ? MATERIAL_FREE : MATERIAL_NONE;
    int next = 0, touched = 0;
    for (int k = 0; k < foot->active; k++, next++) {
        int i = k, e = foot->element[k];
        for (; next < e; next++) {
            element_forget(memory, next, MATERIAL_NONE);
        }
        double w = slot_descent(s, i, m), m1 = s->depth[i] + 0.5 * a->dt * w;
        int lifted = element_lifted(a, i, m1), carried = memory->material[e] >= 0;
        element_advance(s, memory, i, e, a->dt, 1.0 / a->dt, motion_at(m->x, s->x[i], s->y[i]),
                        motion_at(m->y, s->x[i], s->y[i]), w, m1, lifted ? 0.0 : 1.0);
        if (!lifted) {
            element_peak(s, memory, i, e, w, m1);
        }
        memory->material[e] = lifted ? lifted_material : material[i];
        if (a->prints && (carried || !lifted)) {
            element_print(a, memory, i, e, lifted);
        }
        if (foot->uneven) {
            element_plane(foot, a->height, s, memory, i, e);
        }
        touched += !lifted || lifted_material != MATERIAL_NONE;
    }
    for (; next < foot->elements; next++) {
        element_forget(memory, next, MATERIAL_NONE);
    }
    return touched;
}

void mild_ground_advance(MildGround *ground, const MildTerrain *terrain,
                         const MildContactInput *input, const MildScratch *scratch,
                         const MildContactResult *result) {
    if (ground->tiles > 0 && ++ground->print_time == 0) {
        ground->print_time = 1; /* 0 marks an empty tile */
    }
    Prints prints = ground_prints(ground);
    for (int f = 0; f < ground->feet; f++) {
        const FootScratch *foot = &scratch->foot[f];
        ground->uneven[f] = foot->uneven;
        if (ground->touched[f] == 0 && foot->active == 0) {
            continue;
        }
        Memory memory = ground_memory(ground, f);
        Advance advance = {foot,
                           foot->slot,
                           ground->tiles > 0 ? &prints : NULL,
                           input->rotation[f],
                           foot_motion(foot, result->velocity + 6 * f),
                           input->dt,
                           terrain->height};
        int all = foot->active == foot->elements && ground->tiles == 0;
        if (all) {
            slots_remember(&advance.slot,
                           &memory); /* of this ground; the step may have been solved on a copy */
        }
        if (all && foot->uneven) {
            ground->touched[f] = foot_advance_all(&advance, &memory, foot->slot_material, 1);
        } else if (all) {
            ground->touched[f] = foot_advance_all(&advance, &memory, foot->slot_material, 0);
        } else {
            ground->touched[f] = foot_advance(&advance, &memory, foot->slot_material);
        }
    }
}
