/* First stage of a contact step: lists the elements that may touch and fixes the law of each. */
#include <string.h>

#include "ground/law/begin.h"
#include "ground/law/models.h"
#include "ground/step/step.h"
#include "ground/terrain/terrain.h"

/* Calls element_begin. curves, kind: constants in a vector loop. */
MILD_HD void slot_begin(Slots *s, int i, Real dt, Real rate, const Motion *motion, int curves,
                        int kind) {
    const SlotVelocity v = slot_velocity(s, i, motion, kind);
    const ElementMemory memory = slot_memory(s, i);
    Element element = slot_element(s, i);
    if (curves & LAW_HEAP) {
        element.law.cone_begin = s->cone_begin[i];
    }
    element_begin(&element, &memory, curves, dt, rate, v.descent);
    slot_store(s, i, &element);
}

/* Calls element_begin for all slots. On level ground the slopes are 0. */
MILD_HD void slots_begin(const FootScratch *foot, Real dt, const Motion *now, int curves,
                         int shell) {
    const Motion motion = *now;
    const Real rate = 1 / dt;
    for (Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            slot_begin(s, i, dt, rate, &motion, curves, SLOT_UNEVEN | shell);
        }
    }
}

/* Picks the loop compiled for the curves of the ground under the foot. A line is a cone of which
 * all numbers but the line's are 0, and a cone is a heap that begins at the surface and carries all
 * of its load: one loop does for the three. */
static void foot_begin(const FootScratch *foot, Real dt, const Motion *now) {
    switch (foot_variant(foot)) {
    case LAW_LINE:
    case LAW_CONE:
    case LAW_CONE | LAW_HEAP: slots_begin(foot, dt, now, LAW_CONE | LAW_HEAP, 0); return;
    case LAW_POWER: slots_begin(foot, dt, now, LAW_POWER, 0); return;
    case LAW_ELASTIC: slots_begin(foot, dt, now, LAW_ELASTIC, 0); return;
    default: slots_begin(foot, dt, now, LAW_ANY, SLOT_SHELL); return;
    }
}

/* ---- the share of its load that each slot carries ---- */

/* Cosine between the sole and the ground under each slot, into `lean`. Level ground has one for
 * all, without a root for each. */
static void slots_lean(const FootScratch *foot) {
    const double *normal = foot->arm[3];
    const Real side = normal[2] < 0 ? REAL(-1) : REAL(1); /* the face that looks down */
    const Real up[3] = {side * (Real)normal[0], side * (Real)normal[1], side * (Real)normal[2]};
    const Real level = real_min(real_max(up[2], SHARE_LEAN), 1);
    for (Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
        for (int i = 0; i < SLOT_LANES; i++) {
            s->lean[i] = level;
        }
        for (int i = 0; foot->uneven && i < SLOT_LANES; i++) {
            const Real gx = s->slope_x[i], gy = s->slope_y[i];
            const Real along = up[2] - gx * up[0] - gy * up[1];
            s->lean[i] =
                real_min(real_max(along / REAL_SQRT(1 + gx * gx + gy * gy), SHARE_LEAN), 1);
        }
    }
}

/* Calls element_share with the cosine and the ground ahead that the slot has, and keeps what it
 * changes. */
MILD_HD void slot_carry(Slots *s, int i, Real dt, Real rate, const Motion *now) {
    const SlotVelocity v = slot_velocity(s, i, now, SLOT_UNEVEN | SLOT_SHELL);
    const ElementMemory memory = slot_memory(s, i);
    Element element = slot_element(s, i);
    element.law.cone_begin = s->cone_begin[i];
    Share share = slot_share(s, i);
    element_share(&element, &memory, &share, s->fx[i], dt, rate, share.lean, s->ahead[i],
                  v.x * v.x + v.y * v.y);
    s->mu[i] = element.mu;
    s->drift_bound[i] = element.drift_bound;
    s->lean[i] = share.lean;
    s->share[i] = share.q;
    s->zero_depth[i] = element.zero_depth;
    s->hold_x[i] = element.hold_x;
    s->hold_y[i] = element.hold_y;
    s->hold_stiffness[i] = element.hold_stiffness;
}

/* Sets the share of this step and what follows from it, after slots_begin. For ground with
 * LAW_HEAP. */
static void foot_carry(const FootScratch *foot, const Motion *now, double dt) {
    slots_elastic(foot);
    if (foot->shell) {
        shell_lean(foot, now);
    } else {
        slots_lean(foot);
    }
    const double rate = 1.0 / dt;
    const Motion motion = *now;
    for (Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            slot_carry(s, i, dt, rate, &motion);
        }
    }
}

/* ---- drag ---- */

/* Bool: an element on ground with drag will enter virgin ground in this step by more than the
 * elastic travel. */
static int slots_sink(const FootScratch *foot, Real dt) {
    Lanes sinking = {0};
    Real sum = 0;
    for (const Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            const Element element = slot_element(s, i);
            const Real way = element_virgin_way(&element, dt, element.entry_speed);
            sinking[i] += element.entry_drag > 0 ? way : 0;
        }
    }
    for (int i = 0; i < SLOT_LANES; i++) {
        sum += sinking[i];
    }
    return sum > 0;
}

/* Calls element_drag. curves, kind: constants in a vector loop. */
MILD_HD void slot_drag(Slots *s, int i, Real dt, const Motion *now, const Motion *free, int curves,
                       int kind) {
    const Real slower = slot_velocity(s, i, now, kind).descent;
    const Real faster = slot_velocity(s, i, free, kind).descent;
    Element element = slot_loaded(s, i, curves);
    element_drag(&element, curves, dt, real_max(faster - slower, 0));
    s->entry_speed[i] = element.entry_speed;
    s->stop_drag[i] = element.stop_drag;
    s->stop_growth[i] = element.stop_growth;
}

/* The same for all slots of a foot on any ground. */
static void slots_drag_any(const FootScratch *foot, double dt, const Motion *now,
                           const Motion *free) {
    const int curves =
        foot->curves | LAW_CONE | LAW_HEAP; /* no branches for these; a power is long */
    for (int i = 0; i < foot->active; i++) {
        slot_drag(slot_block(foot, i), i % SLOT_LANES, dt, now, free, curves,
                  SLOT_UNEVEN | SLOT_SHELL);
    }
}

/* Calls element_drag for all slots. The loop for cones and heaps, which have drag, is in vectors;
 * that for shells and ground with a power beside them is not. */
static void slots_drag(const FootScratch *foot, Real dt, const Motion *now, const Motion *free) {
    const Motion before = *now;
    const Motion after = *free;
    if (foot_variant(foot) & ~(LAW_CONE | LAW_HEAP)) {
        slots_drag_any(foot, dt, now, free);
        return;
    }
    for (Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            slot_drag(s, i, dt, &before, &after, LAW_CONE | LAW_HEAP, SLOT_UNEVEN);
        }
    }
}

/* Clears what slots_drag and slots_explicit wrote in the step before. */
static void slots_clear(const FootScratch *foot) {
    for (Slots *s = foot->slot; s < slots_all(foot); s++) {
        memset(s->stop_drag, 0, sizeof s->stop_drag);
        memset(s->stop_growth, 0, sizeof s->stop_growth);
        memset(s->explicit_impulse, 0, sizeof s->explicit_impulse);
    }
}

/* Sets the explicit impulse of materials that create energy (passive = false). Returns true when
 * the terrain has such a material. */
static int slots_explicit(const FootScratch *foot, int materials, double dt, const Motion *free) {
    int any = 0;
    for (int m = 0; m < materials; m++) {
        const Law *law = &foot->derived[m].slot.law;
        any |= law_creates(law->mass_rate, law->drag_rate);
    }
    for (int i = 0; any && i < foot->active; i++) {
        Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        if (!(s->depth[l] > 0.0) || s->middle[l] < s->depth_max[l]) {
            continue; /* above the ground or on the unloading line */
        }
        const Element element = slot_loaded(s, l, LAW_ANY);
        s->explicit_impulse[l] = element_explicit(
            &element, LAW_ANY, dt, slot_velocity(s, l, free, SLOT_UNEVEN | foot->shell).descent);
    }
    return any;
}

/* ---- a foot ---- */

/* Applies the models whose law depends on the motion. */
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

/* Gives the slots their elements, material and ground: what they remember, and where they are. */
static void foot_slots(FootScratch *foot, const MildGround *ground, int f,
                       const MildTerrain *terrain, const Memory *memory, const double *R,
                       const Motion *now) {
    slots_gather(foot, memory);
    slots_materials(foot, terrain, memory);
    if (foot->uneven) {
        slots_uneven(foot, ground->uneven[f], memory, terrain->height, now);
    }
    if (ground->tiles > 0) {
        Imprints imprints = ground_imprints(ground);
        slots_imprints(foot, &imprints, memory, R);
    }
}

/* Powers of the depth of the last step: the loop for any law multiplies those that no material of
 * the foot has by 0, which a NaN outlives. */
static void slots_forget_powers(const FootScratch *foot) {
    for (Slots *s = foot->slot, *end = slots_end(foot); s < end; s++) {
        memset(s->power, 0, sizeof s->power);
        memset(s->elastic, 0, sizeof s->elastic);
    }
}

static void foot_prepare(FootScratch *foot, const MildGround *ground, int f,
                         const MildTerrain *terrain, const MildContactInput *input) {
    const Memory memory = ground_memory(ground, f);
    const double *R = input->rotation[f];
    const Motion moves = foot_motion(foot, input->velocity[f]);
    foot_laws(foot, terrain);
    if (foot->shell) {
        shell_slots(foot, ground, f, terrain, &memory, &moves, input->dt);
    } else {
        foot_slots(foot, ground, f, terrain, &memory, R, &moves);
    }
    if (foot->curves & (LAW_POWER | LAW_ELASTIC) || !(foot->curves & (LAW_CONE | LAW_HEAP))) {
        slots_forget_powers(foot);
    }
    foot_frame(foot, terrain, R);
    double before[6], after[6];
    twist_of_world(foot, input->velocity[f], before);
    twist_of_world(foot, input->free_velocity + 6 * f, after);
    const Motion now = foot_motion(foot, before), free = foot_motion(foot, after);
    foot_begin(foot, input->dt, &now);
    if (foot->curves & LAW_HEAP) {
        foot_carry(foot, &now, input->dt);
    }
    if (foot->stops) {
        slots_clear(foot);
    }
    foot->stops = slots_explicit(foot, terrain->material_count, input->dt, &free);
    if (slots_sink(foot, input->dt)) {
        slots_drag(foot, input->dt, &now, &free);
        foot->stops = 1;
    }
    foot_direct(foot, terrain, input->dt, R, &now);
}

/* Places of the feet in the input's rows. */
static void feet_place(MildScratch *scratch, const MildContactInput *input) {
    scratch->given = 0;
    for (int f = 0; f < scratch->feet; f++) {
        const int given = input->rows == 0 || (input->rows >> f & 1) != 0;
        scratch->place[f] = given ? scratch->given : -1;
        scratch->given += given;
    }
}

/* The pose of a foot. Its slopes are cleared where it has come from uneven to level ground. */
static void foot_take_pose(FootScratch *foot, const MildTerrain *terrain,
                           const MildContactInput *input, int f) {
    if (foot->uneven && terrain_is_level(terrain)) {
        slots_level(foot);
    }
    foot_set_pose(foot, terrain, input->position[f], input->rotation[f]);
}

uint32_t mild_ground_near(const MildTerrain *terrain, const MildContactInput *input,
                          MildScratch *scratch) {
    uint32_t near = 0;
    for (int f = 0; f < scratch->feet; f++) {
        FootScratch *foot = &scratch->foot[f];
        foot_take_pose(foot, terrain, input, f);
        const double steepest = foot->uneven ? terrain_steepest(terrain) : 0.0;
        foot_set_least(foot, input, steepest, f);
        near |= foot_is_away(foot, terrain, steepest) ? 0u : 1u << f;
    }
    return near;
}

int contact_prepare(const MildGround *ground, const MildTerrain *terrain,
                    const MildContactInput *input, MildScratch *scratch) {
    feet_place(scratch, input);
    scratch->listed = 0;
    for (int f = 0; f < scratch->feet; f++) {
        FootScratch *foot = &scratch->foot[f];
        foot_take_pose(foot, terrain, input, f);
        foot->uneven |= ground->uneven[f] == GROUND_LOWERED;
        const double steepest = foot->uneven ? terrain_steepest(terrain) : 0.0;
        foot_set_least(foot, input, steepest, f);
        if (scratch->place[f] < 0) {
            foot->away = 1;
            foot->active = 0;
        } else if (foot->shell) {
            shell_list(foot, terrain, steepest);
        } else {
            foot_locate(foot, terrain, ground->tiles > 0);
            foot_list(foot);
        }
        if (foot->active > 0) {
            foot_prepare(foot, ground, f, terrain, input);
            scratch->list[scratch->listed++] = f;
        }
    }
    return scratch->listed;
}
