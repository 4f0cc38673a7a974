#include "ground/prepare.h"

#include <string.h>

#include "ground/begin.h"
#include "ground/gather.h"
#include "ground/locate.h"
#include "ground/mixture.h"
#include "ground/models.h"
#include "ground/terrain.h"

MILD_HD void slot_begin(const Slots *s, int i, double dt, double rate, const Motion *motion,
                        int curves) {
    const SlotVelocity v = slot_velocity(s, i, motion, 1); /* on level ground the slopes are 0 */
    const ElementMemory memory = slot_memory(s, i);
    Element element = slot_element(s, i);
    element_begin(&element, &memory, curves, dt, rate, v.descent);
    slot_store(s, i, &element);
}

/* Calls element_begin for all slots. */
MILD_HD void slots_begin(const Slots *slot, int end, double dt, const Motion *now, int curves) {
    const Slots local = *slot, *s = &local;
    const Motion motion = *now;
    const double rate = 1.0 / dt;
#pragma omp simd
    for (int i = 0; i < end; i++) {
        slot_begin(s, i, dt, rate, &motion, curves);
    }
}

/* Picks the loop compiled for the curves of the ground under the foot. A line is a cone whose other
 * numbers are 0: one loop does for both. */
static void foot_begin(const FootScratch *foot, double dt, const Motion *now) {
    const Slots *s = &foot->slot;
    const int end = foot_end(foot);
    switch (law_variant(foot->curves)) {
    case LAW_LINE:
    case LAW_CONE: slots_begin(s, end, dt, now, LAW_CONE); return;
    case LAW_POWER: slots_begin(s, end, dt, now, LAW_POWER); return;
    case LAW_ELASTIC: slots_begin(s, end, dt, now, LAW_ELASTIC); return;
    default: slots_begin(s, end, dt, now, LAW_ALL); return;
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

MILD_HD void slot_drag(const Slots *s, int i, double dt, const Motion *now, const Motion *free,
                       int curves) {
    const double slower = slot_velocity(s, i, now, 1).descent;
    const double faster = slot_velocity(s, i, free, 1).descent;
    Element element = slot_element(s, i);
    element_drag(&element, curves, dt, real_max(faster - slower, 0.0));
    s->entry_speed[i] = element.entry_speed;
    s->stop_drag[i] = element.stop_drag;
    s->stop_growth[i] = element.stop_growth;
}

/* Calls element_drag for all slots. */
MILD_HD void slots_drag(const Slots *slot, int end, double dt, const Motion *now,
                        const Motion *free, int curves) {
    const Slots local = *slot, *s = &local;
    const Motion before = *now;
    const Motion after = *free;
#pragma omp simd
    for (int i = 0; i < end; i++) {
        slot_drag(s, i, dt, &before, &after, curves);
    }
}

/* Sets the explicit impulse of materials that create energy (passive = false). Returns true when
 * the terrain has such a material. */
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

/* Clears what slots_drag and slots_explicit wrote in the step before. */
static void slots_clear(const FootScratch *foot) {
    const size_t bytes = (size_t)foot->padded * sizeof(double);
    memset(foot->own.stop_drag, 0, bytes);
    memset(foot->own.stop_growth, 0, bytes);
    memset(foot->own.explicit_impulse, 0, bytes);
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
    Motion now = foot_motion(foot, input->velocity[f]);
    Motion free = foot_motion(foot, input->free_velocity + 6 * f);
    foot_begin(foot, input->dt, &now);
    if (foot->stops) {
        slots_clear(foot);
    }
    foot->stops = slots_explicit(foot, terrain->material_count, input->dt, &free);
    if (slots_sink(&foot->slot, foot_end(foot), input->dt)) {
        if (foot->curves & ~LAW_CONE) {
            slots_drag(&foot->slot, foot_end(foot), input->dt, &now, &free, LAW_ALL);
        } else {
            slots_drag(&foot->slot, foot_end(foot), input->dt, &now, &free, LAW_CONE);
        }
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
        foot_locate(foot, terrain, ground->tiles > 0, input->position[f], input->rotation[f]);
        foot_list(foot, input, foot->uneven ? terrain_steepest(terrain) : 0.0, f);
        if (foot->active > 0) {
            foot_prepare(foot, ground, f, terrain, input);
        }
        total += foot->active;
    }
    return total;
}
