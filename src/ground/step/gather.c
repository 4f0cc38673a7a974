#include "ground/step/gather.h"

#include <string.h>

#include "ground/step/mixture.h"

/* Copies where element e is, and what it remembers, to lane l of a block. */
MILD_HD void slot_take(Slots *s, int l, const FootScratch *foot, const Memory *memory, int e) {
    s->x[l] = foot->x[e];
    s->y[l] = foot->y[e];
    s->depth[l] = foot->depth[e];
    s->depth_max[l] = memory->depth_max[e];
    s->last_middle[l] = memory->middle[e];
    s->last_speed[l] = memory->front_speed[e];
    s->drift[l] = memory->drift[e];
    s->pending_x[l] = memory->pending_x[e];
    s->pending_y[l] = memory->pending_y[e];
    s->held_x[l] = memory->held_x[e];
    s->held_y[l] = memory->held_y[e];
    s->held_stiffness[l] = memory->held_stiffness[e];
    s->worn[l] = memory->worn[e];
}

/* All elements, with the padding of their arrays: by whole vectors. */
static void slots_take(const FootScratch *foot, const Memory *all) {
    const Memory memory = *all;
    int e = 0;
    for (Slots *s = foot->slot, *end = slots_end(foot); s < end; s++, e += SLOT_LANES) {
#pragma omp simd
        for (int l = 0; l < SLOT_LANES; l++) {
            slot_take(s, l, foot, &memory, e + l);
        }
    }
}

void slots_gather(const FootScratch *foot, const Memory *memory) {
    if (slots_are_whole(foot)) {
        slots_take(foot, memory);
    } else {
        for (int i = 0; i < foot->active; i++) {
            slot_take(slot_block(foot, i), i % SLOT_LANES, foot, memory, foot->element[i]);
        }
        slots_pad(foot);
    }
    for (int i = foot->active; i < foot_end(foot); i++) {
        slot_block(foot, i)->depth[i % SLOT_LANES] = PADDING_DEPTH;
    }
}

/* Bool: the surface does not lie lower under an element that carries nothing: it is above the
 * terrain, or the foot is on ground that has not changed. While it rises it may have been below. */
static int slot_is_out(const Slots *s, int l, int32_t before, const Motion *now) {
    return s->depth[l] <= 0.0 &&
           (before != GROUND_LOWERED ||
            slot_velocity(s, l, now, SLOT_UNEVEN | SLOT_SHELL).descent >= 0.0);
}

void slots_uneven(const FootScratch *foot, int32_t before, const Memory *memory, double height,
                  const Motion *now) {
    for (int i = 0; i < foot->active; i++) {
        Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        const int e = foot->element[i];
        const int m = memory->material[e];
        s->slope_x[l] = foot->slope_x[e];
        s->slope_y[l] = foot->slope_y[e];
        if (!before || m == MATERIAL_NONE || m == MATERIAL_BURIED ||
            (m == MATERIAL_FREE && slot_is_out(s, l, before, now))) {
            continue;
        }
        const double plane = height + memory->plane[e] + memory->slope_x[e] * foot->point_x[e] +
                             memory->slope_y[e] * foot->point_y[e] - foot->point_z[e];
        s->depth[l] = real_min(s->depth[l], plane);
    }
    for (int i = foot->active; i < foot_end(foot); i++) {
        slot_block(foot, i)->slope_x[i % SLOT_LANES] = 0.0;
        slot_block(foot, i)->slope_y[i % SLOT_LANES] = 0.0;
    }
}

void slot_scale(Slots *s, int i, double share) {
    Real *const scaled[] = {s->flat_stiffness, s->line_stiffness, s->mass_rate,     s->drag_rate,
                            s->bed_stiffness,  s->power_force,    s->elastic_force, s->exit_drag,
                            s->entry_drag,     s->strength,       s->k_drift,       s->b_drift};
    for (size_t k = 0; k < sizeof scaled / sizeof *scaled; k++) {
        scaled[k][i] *= share;
    }
}

void slots_imprints(const FootScratch *foot, const Imprints *imprints, const Memory *memory,
                    const double *R) {
    for (int i = 0; i < foot->active; i++) {
        Slots *s = slot_block(foot, i);
        const int l = i % SLOT_LANES;
        const int e = foot->element[i];
        const int m = memory->material[e];
        const double lasting = 1.0 - s->recovery[l];
        const double m0 = memory->middle[e];
        if (m >= 0) {
            continue;
        }
        if (!(lasting > 0.0)) { /* not pressed by it: nothing, until it has come out */
            if (m == MATERIAL_FREE && m0 > 0.0) {
                slot_scale(s, l, 0.0);
                foot->slot_material[i] |= SLOT_BARRED;
            }
            continue;
        }
        const ImprintElement here = {foot->point_x[e], foot->point_y[e], foot->pitch, R};
        const double found = imprints_read(imprints, &here);
        const double unloaded =
            m == MATERIAL_FREE && m0 > 0.0 ? real_max(m0 / lasting, m0 + ELEMENT_ELASTIC) : 0.0;
        s->depth_max[l] = real_max(found, unloaded);
    }
}

void slots_level(const FootScratch *foot) {
    for (Slots *s = foot->slot; s < slots_all(foot); s++) {
        memset(s->slope_x, 0, sizeof s->slope_x);
        memset(s->slope_y, 0, sizeof s->slope_y);
    }
}
