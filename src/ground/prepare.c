#include <string.h>

#include "ground/friction.h"
#include "ground/prints.h"
#include "ground/resist.h"

#define PREPARE_MARGIN 1e-3  /* [m] elements this close to the ground are listed */
#define PREPARE_NEVER (-1e3) /* [m] depth of the padding */
#define PREPARE_EXTRA_SPEED                                                                        \
    2.0 /* [m/s] an impact at the heel may swing the toe down faster than its free motion */

static void foot_surface(FootScratch *foot, const MildTerrain *terrain) {
    for (int i = 0; i < foot->padded; i++) {
        double slope[2];
        foot->depth[i] =
            terrain_surface(terrain, foot->point_x[i], foot->point_y[i], slope) - foot->point_z[i];
        foot->slope_x[i] = slope[0];
        foot->slope_y[i] = slope[1];
    }
}

void foot_points(const FootScratch *foot) {
    const double *x = foot->x, *y = foot->y, *o = foot->origin, *e = foot->arm[1],
                 *n = foot->arm[2];
    const double ox = o[0] + foot->arm[0][0], oy = o[1] + foot->arm[0][1],
                 oz = o[2] + foot->arm[0][2];
    const double ex = e[0], ey = e[1], ez = e[2], nx = n[0], ny = n[1], nz = n[2];
#pragma omp simd
    for (int i = 0; i < foot->padded; i++) {
        foot->point_x[i] = ox + ex * x[i] + nx * y[i];
        foot->point_y[i] = oy + ey * x[i] + ny * y[i];
        foot->point_z[i] = oz + ez * x[i] + nz * y[i];
    }
}

/* How deep every element is; and where it is, if the ground is not the same everywhere. */
static void foot_place(FootScratch *foot, const MildTerrain *terrain, int prints,
                       const double *position, const double *R) {
    for (int k = 0; k < 3; k++) {
        foot->origin[k] = position[k];
        foot->arm[0][k] = R[3 * k + 2] * foot->z;
        foot->arm[1][k] = R[3 * k];
        foot->arm[2][k] = R[3 * k + 1];
    }
    foot->uneven = !terrain_is_level(terrain);
    if (foot->uneven || prints || !terrain_is_uniform(terrain)) {
        foot_points(foot);
    }
    if (foot->uneven) {
        foot_surface(foot, terrain);
    } else {
        const double *x = foot->x, *y = foot->y, ez = foot->arm[1][2], nz = foot->arm[2][2];
        const double above = terrain->height - position[2] - foot->arm[0][2];
        double *depth = foot->depth;
#pragma omp simd
        for (int i = 0; i < foot->padded; i++) {
            depth[i] = above - ez * x[i] - nz * y[i];
        }
    }
    for (int i = foot->elements; i < foot->padded; i++) {
        foot->depth[i] = PREPARE_NEVER;
    }
}

/* Fastest any point of the foot can come down under twist V, or the ground come up to it. */
static double foot_descent(const FootScratch *foot, const double *V, double steepest) {
    double tilt = V[3] * V[3] + V[4] * V[4], level = sqrt(V[0] * V[0] + V[1] * V[1]);
    return step_max(-V[2], 0.0) + foot->radius * sqrt(tilt) +
           steepest * (level + foot->radius * sqrt(tilt + V[5] * V[5]));
}

/* Lists the elements that may touch, in order. All or none, the common cases, are found without a
 * branch per element. */
static void foot_list(FootScratch *foot, const MildContactInput *input, double steepest, int f) {
    double descent = step_max(foot_descent(foot, input->velocity[f], steepest),
                              foot_descent(foot, input->free_velocity + 6 * f, steepest));
    double least = -PREPARE_MARGIN - input->dt * (descent + PREPARE_EXTRA_SPEED), near = 0.0;
    const double *depth = foot->depth;
    int end = least < PREPARE_NEVER
                  ? foot->elements
                  : foot->padded; /* whole vectors, unless that would list the padding */
#pragma omp simd reduction(+ : near)
    for (int i = 0; i < end; i++) {
        near += depth[i] > least ? 1.0 : 0.0;
    }
    foot->active = (int)near;
    if (foot->active == 0) {
        return;
    }
    int all = foot->active == foot->elements, active = 0;
    if (all && foot->whole) {
        return;
    }
    for (int i = 0; i < foot->elements; i++) {
        foot->element[active] = i;
        active += all | (foot->depth[i] > least);
    }
    foot->whole = all;
}

/* Bool: a mixture, coded as in Memory, has material m in it. */
static int mixture_has(int32_t mixture, int m) {
    return mixture >= 0 &&
           ((mixture & 0xff) == m || (mixture >> 16 > 0 && (mixture >> 8 & 0xff) == m));
}

static int law_is_nan(const Law *law, const MildMaterial *m) {
    double sum = law->flat + law->cone + law->full + law->mass + law->drag + law->bed_stiffness;
    return isnan(sum + law->inverse_full + m->mu + m->k_drift + m->b_drift + m->recovery) ||
           isnan(law->bed);
}

/* Derives the laws of the terrain's materials anew where their numbers have changed. */
static void foot_laws(FootScratch *foot, const MildTerrain *terrain) {
    foot->nan = 0;
    for (int m = 0; m < terrain->material_count; m++) {
        DerivedLaw *derived = &foot->derived[m];
        const MildMaterial *wanted = &terrain->materials[m];
        if (derived->known && memcmp(&derived->material, wanted, sizeof *wanted) == 0) {
            foot->nan |= derived->nan;
            continue;
        }
        *derived = (DerivedLaw){*wanted, law_of(wanted, foot->pitch), 1, 0};
        derived->nan = law_is_nan(&derived->law, wanted);
        foot->nan |= derived->nan;
        for (int i = 0; i < foot->padded; i++) {
            if (mixture_has(foot->slot_material[i], m)) {
                foot->slot_material[i] = MATERIAL_NONE;
            }
        }
    }
}

static void slot_set_law(const Slots *s, int i, const Law *law, const MildMaterial *material) {
    s->flat[i] = law->flat;
    s->cone[i] = law->cone;
    s->full[i] = law->full;
    s->inverse_full[i] = law->inverse_full;
    s->drag[i] = law->drag;
    s->mass_rate[i] = law->mass;
    s->join[i] = 0.5 * (step_max(law->drag, 0.0) + step_max(law->mass, 0.0));
    s->leave[i] = 0.5 * (step_max(law->drag, 0.0) - step_max(law->mass, 0.0));
    s->bed[i] = law->bed;
    s->bed_stiffness[i] = law->bed_stiffness;
    s->mu[i] = material->mu;
    s->k_drift[i] = material->k_drift;
    s->b_drift[i] = material->b_drift;
    s->recovery[i] = material->recovery;
    s->strength[i] = law->cone;
}

/* Every number of the law that the steps use, and friction and recovery, change linearly from one
 * material to the other. A mean of two passive laws is one: it has c_d m >= m/2 too. */
static void slot_set_mixture(const Slots *s, int i, const DerivedLaw *derived, int32_t mixture) {
    const DerivedLaw *a = &derived[mixture & 0xff], *b = &derived[mixture >> 8 & 0xff];
    const Law *p = &a->law, *q = &b->law;
    const MildMaterial *m = &a->material, *n = &b->material;
    double t = (mixture >> 16) / 255.0;
#define MIX(x, y) ((x) + t * ((y) - (x)))
    Law law = {.flat = MIX(p->flat, q->flat),
               .cone = MIX(p->cone, q->cone),
               .full = MIX(p->full, q->full),
               .mass = MIX(p->mass, q->mass),
               .drag = MIX(p->drag, q->drag),
               .bed = MIX(p->bed, q->bed),
               .bed_stiffness = MIX(p->bed_stiffness, q->bed_stiffness)};
    MildMaterial material = {.mu = MIX(m->mu, n->mu),
                             .k_drift = MIX(m->k_drift, n->k_drift),
                             .b_drift = MIX(m->b_drift, n->b_drift),
                             .recovery = MIX(m->recovery, n->recovery)};
#undef MIX
    law.inverse_full = 1.0 / law.full;
    slot_set_law(s, i, &law, &material);
}

/* The padding has no law: whatever its depth, it makes no force. */
static void slots_pad(const FootScratch *foot) {
    static const Law none;
    static const MildMaterial nothing;
    for (int i = foot->active; i < foot_end(foot); i++) {
        foot->slot_material[i] = MATERIAL_NONE;
        slot_set_law(&foot->slot, i, &none, &nothing);
    }
}

/* Material of each slot: the one it touched down on, so that a foot sliding over a border keeps its
 * law. */
static void slots_materials(const FootScratch *foot, const MildTerrain *terrain,
                            const Memory *memory) {
    int count = terrain->material_count;
    if (terrain_is_uniform(terrain)) { /* whose law stands in the slots already */
        const int32_t *remembered = memory->material, *set = foot->slot_material;
        int32_t wrong = 0;
        for (int e = 0; e < foot->elements; e++) {
            wrong |= remembered[e] > 0;
        }
        for (int k = 0; k < foot->active; k++) {
            wrong |= set[k];
        }
        if (!wrong) {
            return;
        }
    }
    for (int i = 0; i < foot->active; i++) {
        int e = foot->element[i], m = memory->material[e];
        if (m < 0 || (m & 0xff) >= count || (m >> 8 & 0xff) >= count) {
            m = terrain_mixture(terrain, foot->point_x[e], foot->point_y[e]);
        }
        if (foot->slot_material[i] == m) {
            continue;
        }
        foot->slot_material[i] = m;
        if (m <= 0xff) {
            slot_set_law(&foot->slot, i, &foot->derived[m].law, &terrain->materials[m]);
        } else {
            slot_set_mixture(&foot->slot, i, foot->derived, m);
        }
    }
}

/* All elements are listed, on ground without prints: their numbers are read where they lie. */
static void slots_direct(FootScratch *foot, const Memory *memory) {
    Slots *s = &foot->slot;
    *s = foot->own;
    s->x = foot->x;
    s->y = foot->y;
    slots_remember(s, memory);
    if (foot->uneven) { /* which may lessen the depth */
        memcpy(s->depth, foot->depth, (size_t)foot->padded * sizeof *s->depth);
    } else {
        s->depth = foot->depth;
    }
}

/* The list's elements side by side. */
static void slots_gather(FootScratch *foot, const Memory *memory) {
    Slots from = foot->own, *s = &foot->slot;
    from.x = foot->x;
    from.y = foot->y;
    from.depth = foot->depth;
    slots_remember(&from, memory);
    *s = foot->own;
    const double *const all[] = {from.x,
                                 from.y,
                                 from.depth,
                                 from.depth_max,
                                 from.remembered_middle,
                                 from.remembered_speed,
                                 from.drift,
                                 from.pending_x,
                                 from.pending_y,
                                 from.held_x,
                                 from.held_y,
                                 from.held_grip};
    double *const listed[] = {s->x,
                              s->y,
                              s->depth,
                              s->depth_max,
                              s->remembered_middle,
                              s->remembered_speed,
                              s->drift,
                              s->pending_x,
                              s->pending_y,
                              s->held_x,
                              s->held_y,
                              s->held_grip};
    int end = foot_end(foot), active = foot->active;
    for (size_t a = 0; a < sizeof all / sizeof *all; a++) {
        for (int i = 0; i < active; i++) {
            listed[a][i] = all[a][foot->element[i]];
        }
        for (int i = active; i < end; i++) {
            listed[a][i] = 0.0;
        }
    }
    for (int i = active; i < end; i++) {
        s->depth[i] = PREPARE_NEVER;
    }
    slots_pad(foot);
}

/* Uneven ground under the slots; before: it was uneven in the last step, too. The step takes the
 * ground under an element for its tangent plane there. Where the ground rises faster, the element
 * would find itself deeper without having been pressed down, with energy from nowhere; so an
 * element goes on from the depth that the last step's plane gives, if that is less, as long as it
 * stays in the ground. */
static void slots_uneven(const FootScratch *foot, int32_t before, const Memory *memory,
                         double height) {
    const Slots *s = &foot->slot;
    for (int i = 0; i < foot->active; i++) {
        int e = foot->element[i], m = memory->material[e];
        s->slope_x[i] = foot->slope_x[e];
        s->slope_y[i] = foot->slope_y[e];
        if (!before || m == MATERIAL_NONE || (m == MATERIAL_FREE && s->depth[i] <= 0.0)) {
            continue;
        }
        double plane = height + memory->plane[e] + memory->slope_x[e] * foot->point_x[e] +
                       memory->slope_y[e] * foot->point_y[e] - foot->point_z[e];
        s->depth[i] = step_min(s->depth[i], plane);
    }
    for (int i = foot->active; i < foot_end(foot); i++) {
        s->slope_x[i] = s->slope_y[i] = 0.0;
    }
}

/* An element that carries nothing finds what the ground under it remembers. Below h0, in a print,
 * it takes at least the depth whose unloading line ends where it is, so that moving sideways in a
 * print never loads it. */
static void slots_prints(const FootScratch *foot, const Prints *prints, const Memory *memory,
                         const double *R) {
    const Slots *s = &foot->slot;
    for (int i = 0; i < foot->active; i++) {
        int e = foot->element[i], m = memory->material[e];
        double lasting = 1.0 - s->recovery[i], m0 = memory->middle[e];
        if (m >= 0 || !(lasting > 0.0)) {
            continue;
        }
        double found = prints_read(
            prints, &(PrintElement){foot->point_x[e], foot->point_y[e], foot->pitch, R});
        double free =
            m == MATERIAL_FREE && m0 > 0.0 ? step_max(m0 / lasting, m0 + CONTACT_ELASTIC) : 0.0;
        s->depth_max[i] = step_max(found, free);
    }
}

/* Slopes of a foot that has left uneven ground; level ground is not to pay for them. */
static void slots_level(const FootScratch *foot) {
    size_t bytes = (size_t)foot->padded * sizeof(double);
    memset(foot->own.slope_x, 0, bytes);
    memset(foot->own.slope_y, 0, bytes);
}

/* Bool: at its present speed an element on ground with drag goes on into virgin ground, by more
 * than is soon made good. */
static int slots_sink(const Slots *slot, int end, double dt) {
    const double *depth = slot->depth, *speed = slot->speed, *front = slot->front,
                 *leave = slot->leave;
    double sinking = 0.0;
#pragma omp simd reduction(+ : sinking)
    for (int i = 0; i < end; i++) {
        double way = step_virgin_way(depth[i], speed[i], front[i], dt);
        sinking += leave[i] > 0.0 ? way : 0.0;
    }
    return sinking > 0.0;
}

/* The drag of elements that sink, and their speed at the front, see step.h. F: about the middle of
 * the step. */
static void slots_drag(const Slots *slot, int end, double dt, const Motion *now,
                       const Motion *free) {
    const Slots local = *slot, *s = &local;
    const Motion before = *now, after = *free;
#pragma omp simd
    for (int i = 0; i < end; i++) {
        double u0 = s->depth[i], a = s->front[i], b = step_max(u0, a), speed = s->speed[i],
               third = s->full[i] * (1.0 / 3.0);
        double extra = step_max(2.0 * s->leave[i], 0.0),
               sinks = step_virgin_way(u0, speed, a, dt) > 0.0 ? 1.0 : 0.0;
        double c0 = step_max(1.0 - a * s->inverse_full[i], 0.0),
               c1 = step_max(1.0 - b * s->inverse_full[i], 0.0);
        double square = c0 * c0, cube = square * c0, slope = s->flat[i] * square + s->cone[i];
        double force = s->flat[i] * third * (1.0 - cube) + s->cone[i] * a + 0.5 * slope * (b - a);
        double faster = step_max(slot_descent(s, i, &after) - slot_descent(s, i, &before), 0.0);
        double gain = faster / dt * step_max(a - s->middle[i], 0.0);
        double drag = extra > 0.0 ? sinks : 0.0, hit = sqrt(speed * speed + 2.0 * drag * gain);
        double still = step_min(STEP_STILL + sqrt(force / (extra * square * hit * hit + STEP_TINY)),
                                STEP_STILL_MOST);
        s->speed[i] = hit;
        s->bend[i] = drag * extra * (still - 0.5) / (hit + STEP_TINY);
        s->stopped[i] = drag * third * (cube - c1 * c1 * c1);
    }
}

/* Everything of step.h that does not depend on the new velocity. The unloading line runs from (a,
 * F_g(a)) to zero force after recovery * a, but not within CONTACT_ELASTIC. It is never flatter
 * than the loading curve at a, and so never above it: a concave curve lies above its chords, a
 * convex one above its tangent; in the bed the steepest slope is taken. */
ALWAYS_INLINE void slots_prepare(const Slots *slot, int end, double dt, Motion now, int uneven) {
    const Slots local = *slot, *s = &local;
    double rate = 1.0 / dt;
#pragma omp simd
    for (int i = 0; i < end; i++) {
        double x = s->x[i], y = s->y[i], u0 = s->depth[i], used = s->depth_max[i];
        double w_now = -(now.z[0] + now.z[1] * x + now.z[2] * y);
        if (uneven) {
            w_now += s->slope_x[i] * (now.x[0] + now.x[1] * x + now.x[2] * y) +
                     s->slope_y[i] * (now.y[0] + now.y[1] * x + now.y[2] * y);
        }
        double old = s->remembered_middle[i], m0 = old > 0.0 ? old : u0 - 0.5 * dt * w_now,
               a = step_max(step_max(m0, used), 0.0);
        double c0 = step_max(1.0 - a * s->inverse_full[i], 0.0),
               flat_share = s->full[i] * (1.0 / 3.0) * (1.0 - c0 * c0 * c0);
        double in_bed = a - s->bed[i], bed_stiffness = s->bed_stiffness[i],
               bed = in_bed > 0.0 ? bed_stiffness : 0.0;
        double force = s->flat[i] * flat_share + s->cone[i] * a + bed * in_bed;
        double travel = step_max(s->recovery[i] * a, step_min(CONTACT_ELASTIC, a));
        double curve = s->flat[i] * c0 * c0, flat = step_max(s->flat[i], 0.0),
               steepest = in_bed > 0.0 ? flat : curve;
        double steep = steepest + s->cone[i] + bed,
               chord = force >= steep * travel ? 1.0 : 0.0; /* one division serves both */
        double over = force / ((chord > 0.0 ? travel : steep) + STEP_TINY),
               line = chord > 0.0 ? over : steep;
        double slack = a - (chord > 0.0 ? travel : over);
        s->middle[i] = m0;
        s->front[i] = a;
        s->deep[i] = a;
        s->line[i] = line;
        s->slack[i] = slack;
        double speed = step_max(w_now, 0.0), reach = step_max(2.0 * (a - u0) * rate, 0.0),
               added = s->mass_rate[i] * flat_share;
        s->reach[i] = reach;
        s->front_speed[i] = step_max(s->remembered_speed[i], reach);
        s->speed[i] = speed;
        s->mass[i] = step_max(added, 0.0);
        s->drift_radius[i] = dt * s->k_drift[i] * s->drift[i] * step_max(u0, 0.0);
        s->damping[i] = u0 > 0.0 ? dt * s->b_drift[i] : 0.0;
        slot_grip(s, i, dt, rate, force);
    }
}

/* Bool: there are parameters that create energy (passive = false). They cannot be implicit and
 * enter with the free motion. */
static int slots_explicit(const FootScratch *foot, int materials, double dt, const Motion *free) {
    const Slots *s = &foot->slot;
    int any = 0;
    for (int m = 0; m < materials; m++) {
        any |= foot->derived[m].law.mass < 0.0 || foot->derived[m].law.drag < 0.0;
    }
    for (int i = 0; any && i < foot->active; i++) {
        double a = s->front[i], c0 = step_max(1.0 - a * s->inverse_full[i], 0.0),
               speed = s->speed[i];
        double added = s->mass_rate[i] * s->full[i] * (1.0 / 3.0) * (1.0 - c0 * c0 * c0);
        if (!(s->depth[i] > 0.0) || s->middle[i] < s->depth_max[i]) {
            continue;
        }
        s->explicit_impulse[i] =
            step_min(added, 0.0) * (slot_descent(s, i, free) - s->front_speed[i]) +
            step_min(s->drag[i], 0.0) * c0 * c0 * dt * speed * speed;
    }
    return any;
}

static void slots_unbend(const FootScratch *foot) {
    size_t bytes = (size_t)foot->padded * sizeof(double);
    memset(foot->own.bend, 0, bytes);
    memset(foot->own.stopped, 0, bytes);
    memset(foot->own.explicit_impulse, 0, bytes);
}

static void foot_prepare(FootScratch *foot, const MildGround *ground, int f,
                         const MildTerrain *terrain, const MildContactInput *input) {
    const Memory memory = ground_memory(ground, f);
    const double *R = input->rotation[f];
    foot_laws(foot, terrain);
    if (foot->active == foot->elements && ground->tiles == 0) {
        slots_direct(foot, &memory);
    } else {
        slots_gather(foot, &memory);
    }
    slots_materials(foot, terrain, &memory);
    if (foot->uneven) {
        slots_uneven(foot, ground->uneven[f], &memory, terrain->height);
    }
    if (ground->tiles > 0) {
        Prints prints = ground_prints(ground);
        slots_prints(foot, &prints, &memory, R);
    }
    Motion now = foot_motion(foot, input->velocity[f]),
           free = foot_motion(foot, input->free_velocity + 6 * f);
    if (foot->uneven) {
        slots_prepare(&foot->slot, foot_end(foot), input->dt, now, 1);
    } else {
        slots_prepare(&foot->slot, foot_end(foot), input->dt, now, 0);
    }
    if (foot->bent) {
        slots_unbend(foot);
    }
    foot->bent = slots_explicit(foot, terrain->material_count, input->dt, &free);
    if (slots_sink(&foot->slot, foot_end(foot), input->dt)) {
        slots_drag(&foot->slot, foot_end(foot), input->dt, &now, &free);
        foot->bent = 1;
    }
    slots_resist(foot, terrain, input->dt, R, &now);
}

int contact_prepare(const MildGround *ground, const MildTerrain *terrain,
                    const MildContactInput *input, MildScratch *scratch) {
    int total = 0;
    for (int f = 0; f < scratch->feet; f++) {
        FootScratch *foot = &scratch->foot[f];
        if (foot->uneven && terrain_is_level(terrain)) {
            slots_level(foot);
        }
        foot_place(foot, terrain, ground->tiles > 0, input->position[f], input->rotation[f]);
        foot_list(foot, input, foot->uneven ? terrain_steepest(terrain) : 0.0, f);
        if (foot->active > 0) {
            foot_prepare(foot, ground, f, terrain, input);
        }
        total += foot->active;
    }
    return total;
}
