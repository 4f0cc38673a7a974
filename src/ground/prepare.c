#include "ground/prepare.h"

#include <string.h>

#include "ground/begin.h"
#include "ground/model.h"
#include "ground/terrain.h"

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

/* How deep every element is; and where it is, if the ground is not the same everywhere. */
static void foot_place(FootScratch *foot, const MildTerrain *terrain, int imprints,
                       const double *position, const double *R) {
    for (int k = 0; k < 3; k++) {
        foot->origin[k] = position[k];
        foot->arm[0][k] = R[3 * k + 2] * foot->z;
        foot->arm[1][k] = R[3 * k];
        foot->arm[2][k] = R[3 * k + 1];
    }
    foot->uneven = !terrain_is_level(terrain);
    if (foot->uneven || imprints || !terrain_is_uniform(terrain)) {
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
    return real_max(-V[2], 0.0) + foot->radius * sqrt(tilt) +
           steepest * (level + foot->radius * sqrt(tilt + V[5] * V[5]));
}

/* Lists the elements that may touch, in order. All or none, the common cases, are found without a
 * branch per element. */
static void foot_list(FootScratch *foot, const MildContactInput *input, double steepest, int f) {
    double descent = real_max(foot_descent(foot, input->velocity[f], steepest),
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

static int material_is_nan(const MildMaterial *m) {
    return isnan(m->mu + m->k_drift + m->b_drift + m->recovery + m->cohesion + m->shear_length);
}

/* Derives the laws of the terrain's materials anew where their numbers have changed. */
static void foot_laws(FootScratch *foot, const MildTerrain *terrain) {
    foot->nan = 0;
    foot->curves = LAW_LINE;
    for (int m = 0; m < terrain->material_count; m++) {
        DerivedLaw *derived = &foot->derived[m];
        const MildMaterial *wanted = &terrain->materials[m];
        if (!derived->known || memcmp(&derived->material, wanted, sizeof *wanted) != 0) {
            const Law law = law_of(wanted, foot->pitch);
            *derived = (DerivedLaw){.material = *wanted,
                                    .law = law,
                                    .curves = law_curves(&law),
                                    .known = 1,
                                    .nan = law_is_nan(&law) || material_is_nan(wanted)};
            for (int i = 0; i < foot->padded; i++) {
                if (mixture_has(foot->slot_material[i], m)) {
                    foot->slot_material[i] = MATERIAL_NONE;
                }
            }
        }
        foot->nan |= derived->nan;
        foot->curves |= derived->curves;
    }
}

#define SLOT_LAW_STORE(name) s->name[i] = law->name;
static void slot_set_law(const Slots *s, int i, const Law *law, const MildMaterial *material) {
    const double mass = real_max(law->mass_rate, 0.0);
    const double drag = real_max(law->drag_rate, 0.0);
    LAW_NUMBERS(SLOT_LAW_STORE)
    s->exit_drag[i] = 0.5 * (drag + mass); /* mass w + (drag - mass) (h + w)/2 */
    s->entry_drag[i] = 0.5 * (drag - mass);
    s->strength[i] = law->line_stiffness;
    s->recovery[i] = law_recovery(law, material->recovery);
    s->mu[i] = material->mu;
    s->k_drift[i] = material->k_drift;
    s->b_drift[i] = material->b_drift;
}

static double between(double a, double b, double share) {
    return a + share * (b - a);
}

/* Law, friction and recovery change linearly from one material to the other. */
static void slot_set_mixture(const Slots *s, int i, const DerivedLaw *derived, int32_t mixture) {
    const DerivedLaw *a = &derived[mixture & 0xff];
    const DerivedLaw *b = &derived[mixture >> 8 & 0xff];
    const MildMaterial *m = &a->material, *n = &b->material;
    const double t = (mixture >> 16) / 255.0;
    const Law law = law_between(&a->law, &b->law, t);
    const MildMaterial material = {
        .mu = between(m->mu, n->mu, t),
        .k_drift = between(m->k_drift, n->k_drift, t),
        .b_drift = between(m->b_drift, n->b_drift, t),
        .recovery =
            between(law_recovery(&a->law, m->recovery), law_recovery(&b->law, n->recovery), t),
    };
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

/* All elements are listed, on ground without imprints: their numbers are read where they lie. */
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
    const double *const all[] = {from.x,         from.y,           from.depth,
                                 from.depth_max, from.last_middle, from.last_speed,
                                 from.drift,     from.pending_x,   from.pending_y,
                                 from.held_x,    from.held_y,      from.held_stiffness};
    double *const listed[] = {s->x,           s->y,          s->depth,  s->depth_max,
                              s->last_middle, s->last_speed, s->drift,  s->pending_x,
                              s->pending_y,   s->held_x,     s->held_y, s->held_stiffness};
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
        s->depth[i] = real_min(s->depth[i], plane);
    }
    for (int i = foot->active; i < foot_end(foot); i++) {
        s->slope_x[i] = s->slope_y[i] = 0.0;
    }
}

/* An element that carries nothing finds what the ground under it remembers. Below h0, in a imprint,
 * it takes at least the depth whose unloading line ends where it is, so that moving sideways in a
 * imprint never loads it. */
static void slots_imprints(const FootScratch *foot, const Imprints *imprints, const Memory *memory,
                           const double *R) {
    const Slots *s = &foot->slot;
    for (int i = 0; i < foot->active; i++) {
        int e = foot->element[i], m = memory->material[e];
        double lasting = 1.0 - s->recovery[i], m0 = memory->middle[e];
        if (m >= 0 || !(lasting > 0.0)) {
            continue;
        }
        double found = imprints_read(
            imprints, &(ImprintElement){foot->point_x[e], foot->point_y[e], foot->pitch, R});
        double free =
            m == MATERIAL_FREE && m0 > 0.0 ? real_max(m0 / lasting, m0 + ELEMENT_ELASTIC) : 0.0;
        s->depth_max[i] = real_max(found, free);
    }
}

/* Slopes of a foot that has left uneven ground; level ground is not to pay for them. */
static void slots_level(const FootScratch *foot) {
    size_t bytes = (size_t)foot->padded * sizeof(double);
    memset(foot->own.slope_x, 0, bytes);
    memset(foot->own.slope_y, 0, bytes);
}

ALWAYS_INLINE void slot_begin(const Slots *s, int i, double dt, double rate, const Motion *motion,
                              int curves, int uneven) {
    const SlotVelocity v = slot_velocity(s, i, motion, uneven);
    const ElementMemory memory = slot_memory(s, i);
    Element element = slot_element(s, i);
    element_begin(&element, &memory, curves, dt, rate, v.descent);
    slot_store(s, i, &element);
}

/* What element_begin sets, for all slots. */
ALWAYS_INLINE void slots_begin(const Slots *slot, int end, double dt, const Motion *now, int curves,
                               int uneven) {
    const Slots local = *slot, *s = &local;
    const Motion motion = *now;
    const double rate = 1.0 / dt;
#pragma omp simd
    for (int i = 0; i < end; i++) {
        slot_begin(s, i, dt, rate, &motion, curves, uneven);
    }
}

/* The loop of the ground under the foot. */
static void foot_begin(const FootScratch *foot, double dt, const Motion *now) {
    const Slots *s = &foot->slot;
    const int end = foot_end(foot);
    if (foot->uneven) {
        switch (law_variant(foot->curves)) {
        case LAW_LINE: slots_begin(s, end, dt, now, LAW_LINE, 1); return;
        case LAW_CONE: slots_begin(s, end, dt, now, LAW_CONE, 1); return;
        default: slots_begin(s, end, dt, now, LAW_ALL, 1); return;
        }
    }
    switch (law_variant(foot->curves)) {
    case LAW_LINE: slots_begin(s, end, dt, now, LAW_LINE, 0); return;
    case LAW_CONE: slots_begin(s, end, dt, now, LAW_CONE, 0); return;
    case LAW_POWER: slots_begin(s, end, dt, now, LAW_POWER, 0); return;
    case LAW_ELASTIC: slots_begin(s, end, dt, now, LAW_ELASTIC, 0); return;
    default: slots_begin(s, end, dt, now, LAW_ALL, 0); return;
    }
}

/* Bool: an element on ground with drag will enter virgin ground in this step by more than the
 * elastic travel. */
static int slots_sink(const Slots *slot, int end, double dt) {
    const Slots local = *slot, *s = &local;
    double sinking = 0.0;
#pragma omp simd reduction(+ : sinking)
    for (int i = 0; i < end; i++) {
        const Element element = slot_element(s, i);
        const double way = element_virgin_way(&element, dt, element.entry_speed);
        sinking += element.entry_drag > 0.0 ? way : 0.0;
    }
    return sinking > 0.0;
}

ALWAYS_INLINE void slot_drag(const Slots *s, int i, double dt, const Motion *now,
                             const Motion *free) {
    const double slower = slot_velocity(s, i, now, 1).descent;
    const double faster = slot_velocity(s, i, free, 1).descent;
    Element element = slot_element(s, i);
    element_drag(&element, LAW_CONE, dt, real_max(faster - slower, 0.0));
    s->entry_speed[i] = element.entry_speed;
    s->stop_drag[i] = element.stop_drag;
    s->stop_growth[i] = element.stop_growth;
}

/* What element_drag sets, for all slots. */
static void slots_drag(const Slots *slot, int end, double dt, const Motion *now,
                       const Motion *free) {
    const Slots local = *slot, *s = &local;
    const Motion before = *now;
    const Motion after = *free;
#pragma omp simd
    for (int i = 0; i < end; i++) {
        slot_drag(s, i, dt, &before, &after);
    }
}

/* Impulses of materials that create energy (passive = false). Returns a bool: there are any. */
static int slots_explicit(const FootScratch *foot, int materials, double dt, const Motion *free) {
    const Slots *s = &foot->slot;
    int any = 0;
    for (int m = 0; m < materials; m++) {
        any |= foot->derived[m].law.mass_rate < 0.0 || foot->derived[m].law.drag_rate < 0.0;
    }
    for (int i = 0; any && i < foot->active; i++) {
        if (!(s->depth[i] > 0.0) || s->middle[i] < s->depth_max[i]) {
            continue; /* above the ground or on the unloading line */
        }
        const Element element = slot_element(s, i);
        s->explicit_impulse[i] =
            element_explicit(&element, dt, slot_velocity(s, i, free, 1).descent);
    }
    return any;
}

/* Sets back what slots_drag and slots_explicit have written in the step before. */
static void slots_clear(const FootScratch *foot) {
    const size_t bytes = (size_t)foot->padded * sizeof(double);
    memset(foot->own.stop_drag, 0, bytes);
    memset(foot->own.stop_growth, 0, bytes);
    memset(foot->own.explicit_impulse, 0, bytes);
}

/* The models whose law depends on the direction of motion. */
static void foot_direct(const FootScratch *foot, const MildTerrain *terrain, double dt,
                        const double *rotation, const Motion *now) {
    unsigned done = 0;
    for (int m = 0; m < terrain->material_count; m++) {
        const int model = terrain->materials[m].model;
        const ModelRow *row = model_row(model);
        if (!row->direction || done >> model & 1) {
            continue;
        }
        done |= 1u << model;
        row->direction(foot, terrain, model, dt, rotation, now);
    }
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
        Imprints imprints = ground_imprints(ground);
        slots_imprints(foot, &imprints, &memory, R);
    }
    Motion now = foot_motion(foot, input->velocity[f]),
           free = foot_motion(foot, input->free_velocity + 6 * f);
    foot_begin(foot, input->dt, &now);
    if (foot->stops) {
        slots_clear(foot);
    }
    foot->stops = slots_explicit(foot, terrain->material_count, input->dt, &free);
    if (slots_sink(&foot->slot, foot_end(foot), input->dt)) {
        slots_drag(&foot->slot, foot_end(foot), input->dt, &now, &free);
        foot->stops = 1;
    }
    foot_direct(foot, terrain, input->dt, R, &now);
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
