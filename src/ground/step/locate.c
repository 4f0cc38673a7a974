/* Where the elements of a foot are, which of them may touch the ground in a step, and their slots:
 * positions and memory. */
#include <string.h>

#include "ground/step/step.h"
#include "ground/terrain/terrain.h"

#define LISTED_MARGIN 1e-3 /* [m] elements this close to the ground are listed */
/* [m/s] Allowance for an impact at the heel, which may swing the toe down faster than its free
 * motion. */
#define LISTED_EXTRA_SPEED 2.0

Motion foot_motion(const FootScratch *foot, const double *V) {
    return foot_moves(foot, V);
}

void foot_surface(FootScratch *foot, const MildTerrain *terrain) {
    for (int i = 0; i < foot->padded; i++) {
        double slope[2];
        foot->depth[i] =
            terrain_surface(terrain, foot->point_x[i], foot->point_y[i], slope) - foot->point_z[i];
        foot->slope_x[i] = slope[0];
        foot->slope_y[i] = slope[1];
    }
}

void foot_set_pose(FootScratch *foot, const MildTerrain *terrain, const double *position,
                   const double *R) {
    for (int k = 0; k < 3; k++) {
        foot->origin[k] = position[k];
        foot->arm[0][k] = R[3 * k + 2] * foot->z;
        foot->arm[1][k] = R[3 * k];
        foot->arm[2][k] = R[3 * k + 1];
        foot->arm[3][k] = R[3 * k + 2];
    }
    foot->uneven = !terrain_is_level(terrain);
    foot->away = 0;
    foot->framed = 0;
    memset(foot->frame, 0, sizeof foot->frame);
    memcpy(foot->lever, foot->arm, sizeof foot->lever);
}

void foot_locate(FootScratch *foot, const MildTerrain *terrain, int imprints) {
    if (foot->uneven || imprints || !terrain_is_uniform(terrain)) {
        foot_points(foot);
    }
    if (foot->uneven) {
        foot_surface(foot, terrain);
    } else {
        const double *x = foot->x;
        const double *y = foot->y;
        const double ez = foot->arm[1][2];
        const double nz = foot->arm[2][2];
        const double above = terrain->height - foot->origin[2] - foot->arm[0][2];
        double *depth = foot->depth;
#pragma omp simd
        for (int i = 0; i < foot->padded; i++) {
            depth[i] = above - ez * x[i] - nz * y[i];
        }
    }
    for (int i = foot->elements; i < foot->padded; i++) {
        foot->depth[i] = PADDING_DEPTH;
    }
}

/* Upper bound [m/s] on the speed at which any point of the foot gets deeper under the twist V.
 * steepest: upper bound [-] on the gradient of the ground. */
static double foot_descent(const FootScratch *foot, const double *V, double steepest) {
    const double tilt = V[3] * V[3] + V[4] * V[4];
    const double level = sqrt(V[0] * V[0] + V[1] * V[1]);
    return real_max(-V[2], 0.0) + foot->radius * sqrt(tilt) +
           steepest * (level + foot->radius * sqrt(tilt + V[5] * V[5]));
}

void foot_set_least(FootScratch *foot, const MildContactInput *input, double steepest, int f) {
    const double descent = real_max(foot_descent(foot, input->velocity[f], steepest),
                                    foot_descent(foot, input->free_velocity + 6 * f, steepest));
    foot->least = -LISTED_MARGIN - input->dt * (descent + LISTED_EXTRA_SPEED);
}

/* [m] Upper bound on the depth of any element: its bounding box against the ground under its middle
 * and the steepest slope from there. */
static double foot_reach(const FootScratch *foot, const MildTerrain *terrain, double steepest) {
    double at[3], low = 0.0, reach = 0.0, slope[2];
    for (int k = 0; k < 3; k++) {
        at[k] = foot->origin[k];
        for (int j = 0; j < 3; j++) {
            at[k] += foot->arm[1 + j][k] * foot->middle[j];
        }
        low += fabs(foot->arm[1 + k][2]) * foot->half[k];
        reach += foot->half[k] * foot->half[k];
    }
    const double height =
        foot->uneven ? terrain_surface(terrain, at[0], at[1], slope) + steepest * sqrt(reach)
                     : terrain->height;
    return height - at[2] + low;
}

int foot_is_away(FootScratch *foot, const MildTerrain *terrain, double steepest) {
    foot->reach = foot_reach(foot, terrain, steepest);
    foot->away = foot->reach <= foot->least;
    return foot->away;
}

void foot_list(FootScratch *foot) {
    const double least = foot->least;
    const double *depth = foot->depth;
    double near = 0.0;
    /* Count whole vectors, unless that would count the padding. */
    const int end = least < PADDING_DEPTH ? foot->elements : foot->padded;
#pragma omp simd reduction(+ : near)
    for (int i = 0; i < end; i++) {
        near += depth[i] > least ? 1.0 : 0.0;
    }
    foot->active = (int)near;
    const int all = foot->active == foot->elements;
    if (foot->active == 0 || (all && foot->whole)) {
        return;
    }
    int active = 0;
    for (int i = 0; i < foot->elements; i++) {
        foot->element[active] = i;
        active += all | (foot->depth[i] > least);
    }
    foot->whole = all;
}

/* ---- slots ---- */

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
