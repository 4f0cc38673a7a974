#include "ground/gather.h"

#include <string.h>

#include "ground/mixture.h"

void slots_direct(FootScratch *foot, const Memory *memory) {
    Slots *s = &foot->slot;
    *s = foot->own;
    s->x = foot->x;
    s->y = foot->y;
    slots_remember(s, memory);
    if (foot->uneven) { /* slots_uneven changes the depth */
        memcpy(s->depth, foot->depth, (size_t)foot->padded * sizeof *s->depth);
    } else {
        s->depth = foot->depth;
    }
}

void slots_gather(FootScratch *foot, const Memory *memory) {
    Slots *s = &foot->slot;
    Slots from = foot->own;
    from.x = foot->x;
    from.y = foot->y;
    from.depth = foot->depth;
    slots_remember(&from, memory);
    *s = foot->own;
    const double *const all[] = {from.x,         from.y,           from.depth,
                                 from.depth_max, from.last_middle, from.last_speed,
                                 from.drift,     from.pending_x,   from.pending_y,
                                 from.held_x,    from.held_y,      from.held_stiffness,
                                 from.worn};
    double *const listed[] = {s->x,           s->y,          s->depth,  s->depth_max,
                              s->last_middle, s->last_speed, s->drift,  s->pending_x,
                              s->pending_y,   s->held_x,     s->held_y, s->held_stiffness,
                              s->worn};
    const int end = foot_end(foot);
    const int active = foot->active;
    for (size_t a = 0; a < sizeof all / sizeof *all; a++) {
        for (int i = 0; i < active; i++) {
            listed[a][i] = all[a][foot->element[i]];
        }
        for (int i = active; i < end; i++) {
            listed[a][i] = 0.0;
        }
    }
    for (int i = active; i < end; i++) {
        s->depth[i] = PADDING_DEPTH;
    }
    slots_pad(foot);
}

void slots_uneven(const FootScratch *foot, int32_t before, const Memory *memory, double height) {
    const Slots *s = &foot->slot;
    for (int i = 0; i < foot->active; i++) {
        const int e = foot->element[i];
        const int m = memory->material[e];
        s->slope_x[i] = foot->slope_x[e];
        s->slope_y[i] = foot->slope_y[e];
        if (!before || m == MATERIAL_NONE || m == MATERIAL_BURIED ||
            (m == MATERIAL_FREE && s->depth[i] <= 0.0)) {
            continue;
        }
        const double plane = height + memory->plane[e] + memory->slope_x[e] * foot->point_x[e] +
                             memory->slope_y[e] * foot->point_y[e] - foot->point_z[e];
        s->depth[i] = real_min(s->depth[i], plane);
    }
    for (int i = foot->active; i < foot_end(foot); i++) {
        s->slope_x[i] = s->slope_y[i] = 0.0;
    }
}

void slot_scale(const Slots *s, int i, double share) {
    double *const scaled[] = {s->flat_stiffness, s->line_stiffness, s->mass_rate,     s->drag_rate,
                              s->bed_stiffness,  s->power_force,    s->elastic_force, s->exit_drag,
                              s->entry_drag,     s->strength,       s->k_drift,       s->b_drift};
    for (size_t k = 0; k < sizeof scaled / sizeof *scaled; k++) {
        scaled[k][i] *= share;
    }
}

void slots_imprints(const FootScratch *foot, const Imprints *imprints, const Memory *memory,
                    const double *R) {
    const Slots *s = &foot->slot;
    for (int i = 0; i < foot->active; i++) {
        const int e = foot->element[i];
        const int m = memory->material[e];
        const double lasting = 1.0 - s->recovery[i];
        const double m0 = memory->middle[e];
        if (m >= 0) {
            continue;
        }
        if (!(lasting > 0.0)) { /* not pressed by it: nothing, until it has come out */
            if (m == MATERIAL_FREE && m0 > 0.0) {
                slot_scale(s, i, 0.0);
                foot->slot_material[i] |= SLOT_BARRED;
            }
            continue;
        }
        const ImprintElement here = {foot->point_x[e], foot->point_y[e], foot->pitch, R};
        const double found = imprints_read(imprints, &here);
        const double unloaded =
            m == MATERIAL_FREE && m0 > 0.0 ? real_max(m0 / lasting, m0 + ELEMENT_ELASTIC) : 0.0;
        s->depth_max[i] = real_max(found, unloaded);
    }
}

void slots_level(const FootScratch *foot) {
    size_t bytes = (size_t)foot->padded * sizeof(double);
    memset(foot->own.slope_x, 0, bytes);
    memset(foot->own.slope_y, 0, bytes);
}
