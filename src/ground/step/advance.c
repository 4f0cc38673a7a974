/* Last stage of a contact step: mild_ground_advance updates what the ground remembers. */
#define POWER_CALLED /* power.h: no vector loop here needs a power */
#include <string.h>

#include "ground/law/frame.h"
#include "ground/law/remember.h"
#include "ground/step/step.h"

/* The elements of a foot in one step. */
typedef struct {
    const FootScratch *foot;
    const Imprints *imprints; /* NULL: the ground forgets at lift-off */
    const double *rotation;   /* [9] foot to world */
    Motion motion;            /* of the foot after the step, in its frame */
    double dt;                /* [s] */
    const MildTerrain *terrain;
} Advance;

/* The numbers that a step gives the memory of an element, in the order of Memory. */
enum { ADVANCE_NUMBERS = 10 };

/* Bool: the element stays in the ground. Without imprints it lifts off when it rises above the
 * undisturbed surface, with imprints as soon as its unloading line carries no force. m1: depth in
 * the middle of the step. prints: bool. */
MILD_HD int slot_stays(const Slots *s, int i, Real m1, int prints) {
    const int pressed = (prints != 0) & (s->recovery[i] < 1);
    return (m1 > 0) & !(pressed & (m1 <= s->zero_depth[i]));
}

/* A loaded element writes its depth into the ground where it lifts off, less what flows back there,
 * and in every cell that it slides out of. Where it slides into an imprint that is deeper than all
 * of its sole it takes over that depth. A greater depth never means more force, and an element
 * takes a lesser one while it carries nothing, so this adds no energy. A shallower imprint may be
 * what a neighbour has just left: who took it over would strike all of the added mass again, from
 * rest, in every cell. v: the element's velocity in the frame of the foot. refill: [-] of the
 * material. */
static void element_imprint(const Advance *a, const Memory *memory, const Slots *s, int i, int e,
                            const SlotVelocity *v, int lifted, double refill) {
    if (!(s->recovery[i] < 1.0)) {
        return;
    }
    const Real *frame = a->foot->frame;
    Real world[3];
    frame_velocity(frame, s->slope_x[i], s->slope_y[i], v->x, v->y, v->descent, world);
    const double x0 = a->foot->point_x[e];
    const double y0 = a->foot->point_y[e];
    const double x1 = x0 + a->dt * world[0];
    const double y1 = y0 + a->dt * world[1];
    if (!lifted && imprints_same_cell(a->imprints, x0, y0, x1, y1)) {
        return;
    }
    const ImprintElement left = {x0, y0, a->foot->pitch, a->rotation};
    if (lifted && refill > 0.0) {
        imprints_fill(a->imprints, &left, (1.0 - refill) * s->virgin_depth[i]);
        return;
    }
    imprints_press(a->imprints, &left, lifted ? s->virgin_depth[i] : memory->depth_max[e]);
    const ImprintElement entered = {x1, y1, a->foot->pitch, a->rotation};
    const double found = lifted ? 0.0 : imprints_read(a->imprints, &entered);
    double deepest = 0.0; /* of the sole */
    for (int other = 0; other < a->foot->elements && deepest < found; other++) {
        deepest = real_max(memory->middle[other], deepest);
    }
    if (found > real_max(deepest + ELEMENT_ELASTIC, memory->depth_max[e])) {
        memory->depth_max[e] = found;
        memory->front_speed[e] = 0.0;
    }
}

/* [m/s] frame_sinks of a slot. v: its velocity in the frame of the foot. */
MILD_HD Real slot_sinks(const Slots *s, int i, const Real frame[3], const SlotVelocity *v) {
    return frame_sinks(frame, s->slope_x[i], s->slope_y[i], v->x, v->y, v->descent);
}

/* [m] element_peak of a slot that reversed within the step. */
static __attribute__((cold, noinline)) double slot_peak(const Slots *s, int i, int curves,
                                                        double speed, double middle) {
    curves |= LAW_CONE | LAW_HEAP; /* no branches for these; a power is long */
    const Element element = slot_loaded(s, i, curves);
    return element_peak(&element, curves, s->iz[i], speed, middle);
}

/* Raises the greatest depth of a slot, of element e, if the element reversed within the step: it
 * was then deeper than at either end. */
static void slot_raise(const Advance *a, const Memory *memory, const Slots *s, int i, int e,
                       const SlotVelocity *v, double middle) {
    const int turns = element_turns(s->entry_speed[i], v->descent);
    const double peak = turns ? slot_peak(s, i, a->foot->curves, v->descent, middle) : middle;
    const double depth =
        s->virgin_depth[i] + peak - s->yield_depth[i] + a->dt * slot_sinks(s, i, a->foot->frame, v);
    memory->depth_max[e] = real_max(depth, memory->depth_max[e]); /* a NaN changes nothing */
}

/* The same for all elements of a foot that stay. It is not part of the vector loop, where taking
 * the address of a local variable would prevent vectorisation. */
static __attribute__((cold, noinline)) void foot_peaks(const Advance *a, const Memory *memory) {
    for (int e = 0; e < a->foot->elements; e++) {
        const Slots *s = slot_block(a->foot, e);
        const int i = e % SLOT_LANES;
        const SlotVelocity v = slot_velocity(s, i, &a->motion, SLOT_UNEVEN);
        const double middle = s->depth[i] + a->dt / 2 * v.descent;
        if (memory->depth_max[e] > 0.0 && element_turns(s->entry_speed[i], v.descent)) {
            slot_raise(a, memory, s, i, e, &v, middle);
        }
    }
}

/* Stores the plane that the step assumed for the ground under the element. */
MILD_HD void slot_plane(const FootScratch *foot, double height, const Slots *s,
                        const Memory *memory, int i, int e) {
    const double slope_x = s->slope_x[i];
    const double slope_y = s->slope_y[i];
    memory->slope_x[e] = slope_x;
    memory->slope_y[e] = slope_y;
    memory->plane[e] = s->depth[i] - slope_x * foot->point_x[e] - slope_y * foot->point_y[e] +
                       foot->point_z[e] - height;
}

/* The same for all elements of a foot. */
static void foot_planes(const FootScratch *all, double height, const Memory *memory) {
    const FootScratch foot = *all; /* copies keep the addresses in registers */
    const Memory own = *memory;
    int e = 0;
    for (const Slots *s = foot.slot, *end = slots_end(&foot); s < end; s++, e += SLOT_LANES) {
#pragma omp simd
        for (int i = 0; i < SLOT_LANES; i++) {
            slot_plane(&foot, height, s, &own, i, e + i);
        }
    }
}

/* After the vector loop: peaks, the padding, and the material of each element. turned: bool, an
 * element reversed. */
static __attribute__((noinline)) void foot_finish(const Advance *a, const Memory *all,
                                                  const int32_t *material, int turned) {
    const int end = a->foot->padded & -VECTOR_LANES; /* changes nothing; no loop for a remainder */
    const double *depth_max = all->depth_max;
    int32_t *remembered = all->material;
    if (turned) {
        foot_peaks(a, all);
    }
    for (int i = a->foot->elements; i < end; i++) {
        memory_forget(all, i, MATERIAL_NONE);
    }
    const int32_t lifted = a->foot->uneven ? MATERIAL_FREE : MATERIAL_NONE;
#pragma omp simd
    for (int i = 0; i < end; i++) {
        remembered[i] = depth_max[i] > 0.0 ? material[i] : lifted;
    }
}

/* The share of the elements of a block that slip has lowered. to: what they remember without it,
 * from number e on. slid: [m] */
static __attribute__((noinline)) void block_slip(const Slots *s, const Memory *to, int e,
                                                 const Real *slid) {
    const double *depth_max = to->depth_max + e;
    double *worn = to->worn + e;
#pragma omp simd
    for (int i = 0; i < SLOT_LANES; i++) {
        const Element element = slot_element(s, i);
        const Share share = slot_share(s, i);
        const Real q = real_max(share_slipped(&element, &share, slid[i]), SHARE_LEAST);
        worn[i] = depth_max[i] > 0 ? 1 - q : 0;
    }
}

/* The same where fresh penetration raises it, too. fresh: [m] */
static __attribute__((noinline)) void block_wear(const Slots *s, const Memory *to, int e,
                                                 const Real *slid, const Real *fresh) {
    double *depth_max = to->depth_max + e;
    double *front_speed = to->front_speed + e;
    double *worn = to->worn + e;
#pragma omp simd
    for (int i = 0; i < SLOT_LANES; i++) {
        const Element element = slot_element(s, i);
        const Share share = slot_share(s, i);
        ElementMemory after = {.depth_max = depth_max[i], .front_speed = front_speed[i]};
        worn[i] = element_wear(&element, &share, &after, slid[i], fresh[i], depth_max[i] > 0);
        depth_max[i] = after.depth_max;
        front_speed[i] = after.front_speed;
    }
}

/* Stores what the elements of some blocks remember, from number e of `memory` on. Adds to the lanes
 * of `count` 1 for each element that stays in the ground, and 1 for each of these that reversed. On
 * level ground the slopes are 0, and without a shell the heights. wears: bool constant, shares
 * wear; else this foot has no frame. */
MILD_HD void blocks_advance(const Advance *a, const Slots *first, const Slots *end,
                            const Memory *memory, int e, int wears, Lanes count[2]) {
    const Memory to = *memory; /* copies keep the addresses in registers */
    const Motion motion = a->motion;
    const Real dt = (Real)a->dt;
    const Real rate = 1 / dt;
    const Real frame[3] = {a->foot->frame[0], a->foot->frame[1], a->foot->frame[2]};
    const int prints = a->imprints != NULL;
    for (const Slots *s = first; s < end; s++, e += SLOT_LANES) {
        Lanes slid, fresh;
        Real changes = 0; /* 1 for each that slips, or more than all of these if it regains */
#pragma omp simd reduction(+ : changes)
        for (int i = 0; i < SLOT_LANES; i++) {
            const SlotVelocity v = slot_velocity(s, i, &motion, SLOT_UNEVEN | SLOT_SHELL);
            const Element element = slot_element(s, i);
            const ElementMemory before = slot_memory(s, i);
            const Real shift = wears ? dt * slot_sinks(s, i, frame, &v) : 0;
            const Real m1 = s->depth[i] + dt / 2 * v.descent;
            const int stays =
                slot_stays(s, i, m1, prints) & (element_deepest(&element, m1) + shift > 0);
            ElementMemory after =
                element_remember(&element, &before, dt, rate, s->iz[i], v.x, v.y, v.descent, stays);
            after = element_sunk(after, shift, stays);
            if (wears) {
                const Share share = slot_share(s, i);
                slid[i] =
                    element_slide(&element, &before, &share, &after, dt, s->iz[i], v.x, v.y, stays);
                fresh[i] = element_fresh(&element, dt, v.descent, frame_slices(frame, v.x, v.y));
                const Real slips = share_slips(&share, slid[i]) ? REAL(1) : 0;
                const Real most =
                    share_regains(&share, slid[i], fresh[i]) ? SLOT_LANES + REAL(1) : slips;
                changes += stays ? most : 0;
                to.worn[e + i] = stays ? 1 - share.q : 0;
            }
            to.depth_max[e + i] = after.depth_max;
            to.middle[e + i] = after.middle;
            to.front_speed[e + i] = after.front_speed;
            to.drift[e + i] = after.drift;
            to.pending_x[e + i] = after.pending_x;
            to.pending_y[e + i] = after.pending_y;
            to.held_x[e + i] = after.held_x;
            to.held_y[e + i] = after.held_y;
            to.held_stiffness[e + i] = after.held_stiffness;
            count[0][i] += stays ? REAL(1) : 0;
            count[1][i] += stays && element_turns(element.entry_speed, v.descent) ? REAL(1) : 0;
        }
        if (wears && changes > SLOT_LANES) {
            block_wear(s, memory, e, slid, fresh);
        } else if (wears && changes > 0) {
            block_slip(s, memory, e, slid);
        }
    }
}

static __attribute__((noinline)) void blocks_wear(const Advance *a, const Slots *first,
                                                  const Slots *end, const Memory *memory, int e,
                                                  Lanes count[2]) {
    blocks_advance(a, first, end, memory, e, 1, count);
}

static __attribute__((noinline)) void blocks_remember(const Advance *a, const Slots *first,
                                                      const Slots *end, const Memory *memory, int e,
                                                      Lanes count[2]) {
    if (a->foot->curves & LAW_HEAP) {
        blocks_wear(a, first, end, memory, e, count);
    } else {
        blocks_advance(a, first, end, memory, e, 0, count);
    }
}

/* A foot with all elements listed, on ground without imprints. Returns how many elements remember
 * something. */
static int foot_advance_all(const Advance *a, const Memory *memory, const int32_t *material) {
    const FootScratch *foot = a->foot;
    Lanes count[2] = {{0.0}};
    double sums[2];
    blocks_remember(a, foot->slot, slots_end(foot), memory, 0, count);
    lanes_sum(count, 2, sums);
    if (foot->uneven) {
        foot_planes(foot, a->terrain->height, memory);
    }
    foot_finish(a, memory, material, sums[1] > 0.0);
    return foot->uneven ? foot->elements : (int)sums[0];
}

/* An element of a shell that is not listed forgets. One that faces up near the ground is buried
 * until it comes out. If it was loaded it leaves an imprint. Returns whether it remembers that it
 * was here. */
static int face_unlisted(const Advance *a, const Memory *memory, int e) {
    const FootScratch *foot = a->foot;
    const int buried = !foot->away && !(foot->area_share[e] > 0.0) && foot->depth[e] > foot->least;
    const int32_t material = memory->material[e];
    const int index = material & 0xff;
    if (buried && a->imprints && material >= 0 && index < a->terrain->material_count &&
        a->terrain->materials[index].recovery < 1.0) {
        const ImprintElement left = {foot->point_x[e], foot->point_y[e], foot->pitch, a->rotation};
        imprints_press(a->imprints, &left, memory->depth_max[e]);
    }
    memory->area_share[e] = 0.0;
    memory_forget(memory, e, buried ? MATERIAL_BURIED : MATERIAL_NONE);
    return buried;
}

/* Elements from `next` to `end` are not listed. Returns how many remember something. */
static __attribute__((noinline)) int foot_unlisted(const Advance *a, const Memory *memory, int next,
                                                   int end) {
    int touched = 0;
    for (; next < end; next++) {
        if (a->foot->shell) {
            touched += face_unlisted(a, memory, next);
        } else {
            memory_forget(memory, next, MATERIAL_NONE);
        }
    }
    return touched;
}

/* Takes lane i of what blocks_remember has stored. wears: bool, shares do. */
static void memory_take(const Memory *memory, int e, double after[ADVANCE_NUMBERS][SLOT_LANES],
                        int i, int wears) {
    memory->depth_max[e] = after[0][i];
    memory->middle[e] = after[1][i];
    memory->front_speed[e] = after[2][i];
    memory->drift[e] = after[3][i];
    memory->pending_x[e] = after[4][i];
    memory->pending_y[e] = after[5][i];
    memory->held_x[e] = after[6][i];
    memory->held_y[e] = after[7][i];
    memory->held_stiffness[e] = after[8][i];
    memory->worn[e] = wears ? after[9][i] : memory->worn[e];
}

/* The general case: some elements are listed, the ground keeps imprints, or the foot is a shell.
 * Returns how many elements remember something. */
static int foot_advance(const Advance *a, const Memory *memory, const int32_t *material) {
    const FootScratch *foot = a->foot;
    const int shell = foot->shell;
    const int32_t lifted_material = a->imprints || foot->uneven ? MATERIAL_FREE : MATERIAL_NONE;
    double after[ADVANCE_NUMBERS][SLOT_LANES]; /* of a block */
    Lanes stays[2];
    const Memory block = {.depth_max = after[0],
                          .middle = after[1],
                          .front_speed = after[2],
                          .drift = after[3],
                          .pending_x = after[4],
                          .pending_y = after[5],
                          .held_x = after[6],
                          .held_y = after[7],
                          .held_stiffness = after[8],
                          .worn = after[9]};
    int next = 0;
    int touched = 0;
    for (int slot = 0; slot < foot->active; slot++) {
        const Slots *s = slot_block(foot, slot);
        const int i = slot % SLOT_LANES;
        const int e = foot->element[slot];
        if (i == 0) {
            memset(stays, 0, sizeof stays);
            blocks_remember(a, s, s + 1, &block, 0, stays);
        }
        touched += foot_unlisted(a, memory, next, e);
        next = e + 1;
        if (shell && !(s->area_share[i] > 0.0)) { /* it carries nothing until it has come out */
            memory->area_share[e] = 0.0;
            memory_forget(memory, e, MATERIAL_BURIED);
            touched++;
            continue;
        }
        const SlotVelocity v = slot_velocity(s, i, &a->motion, SLOT_UNEVEN | shell);
        const double middle = s->depth[i] + a->dt / 2 * v.descent;
        const int lifted = !(stays[0][i] > 0.0);
        const int carried = memory->material[e] >= 0;
        memory_take(memory, e, after, i, foot->curves & LAW_HEAP);
        if (!lifted) {
            slot_raise(a, memory, s, i, e, &v, middle);
        }
        const int barred = (material[slot] & SLOT_BARRED) != 0;
        memory->material[e] = lifted || barred ? lifted_material : material[slot];
        memory->front_speed[e] = barred ? 0.0 : memory->front_speed[e]; /* it carries nothing */
        if (shell) {
            memory->area_share[e] = lifted ? 0.0 : s->area_share[i];
        }
        if (a->imprints && (carried || !lifted)) {
            const double refill = foot->derived[material[slot] & 0xff].material.refill;
            element_imprint(a, memory, s, i, e, &v, lifted, refill);
        }
        if (foot->uneven) {
            slot_plane(foot, a->terrain->height, s, memory, i, e);
        }
        touched += !lifted || lifted_material != MATERIAL_NONE;
    }
    return touched + foot_unlisted(a, memory, next, foot->elements);
}

/* MildGround.uneven after a step. */
static int32_t foot_uneven(const FootScratch *foot, int32_t before) {
    int below = 0;
    for (int e = 0; before == GROUND_LOWERED && !foot->away && e < foot->elements; e++) {
        below |= foot->depth[e] > 0.0;
    }
    return below ? GROUND_LOWERED : foot->uneven;
}

void mild_ground_advance(MildGround *ground, const MildTerrain *terrain,
                         const MildContactInput *input, const MildScratch *scratch,
                         const MildContactResult *result) {
    if (!scratch_fits(scratch, ground) || !scratch->is_number) {
        return;
    }
    if (ground->tiles > 0 && ++ground->imprint_time == 0) {
        ground->imprint_time = 1; /* 0 marks an empty tile */
    }
    const Imprints imprints = ground_imprints(ground);
    for (int f = 0; f < ground->feet; f++) {
        const FootScratch *foot = &scratch->foot[f];
        ground->uneven[f] = foot_uneven(foot, ground->uneven[f]);
        if (ground->touched[f] == 0 && foot->active == 0 && (!foot->shell || foot->away)) {
            continue;
        }
        const Memory memory = ground_memory(ground, f);
        double twist[6];
        twist_of_world(foot, result->velocity + 6 * f, twist);
        const Advance advance = {.foot = foot,
                                 .imprints = ground->tiles > 0 ? &imprints : NULL,
                                 .rotation = foot->shell ? shell_level : input->rotation[f],
                                 .motion = foot_motion(foot, twist),
                                 .dt = input->dt,
                                 .terrain = terrain};
        const int all = slots_are_whole(foot) && ground->tiles == 0 && !foot->shell;
        if (all) {
            ground->touched[f] = foot_advance_all(&advance, &memory, foot->slot_material);
        } else {
            ground->touched[f] = foot_advance(&advance, &memory, foot->slot_material);
        }
    }
}
