#include "ground/step/prepare.h"

#include <string.h>

#include "ground/law/begin.h"
#include "ground/law/models.h"
#include "ground/step/carry.h"
#include "ground/step/drag.h"
#include "ground/step/frame.h"
#include "ground/step/gather.h"
#include "ground/step/locate.h"
#include "ground/step/mixture.h"
#include "ground/step/shell.h"
#include "ground/terrain/terrain.h"

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
        near |= foot_is_away(foot, terrain, input, steepest, f) ? 0u : 1u << f;
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
        if (scratch->place[f] < 0) {
            foot->away = 1;
            foot->active = 0;
        } else if (foot->shell) {
            shell_list(foot, terrain, input, steepest, f);
        } else {
            foot_locate(foot, terrain, ground->tiles > 0);
            foot_list(foot, input, steepest, f);
        }
        if (foot->active > 0) {
            foot_prepare(foot, ground, f, terrain, input);
            scratch->list[scratch->listed++] = f;
        }
    }
    return scratch->listed;
}
