/* Inertia of the links in world axes, and M by the method of composite rigid bodies (Featherstone,
 * Rigid Body Dynamics Algorithms, 2008, section 6.2).
 *
 * Each inertia is about the anchor of its own hinge. About one common point the small moments of a
 * foot would be differences of large ones, which float does not have. */
#ifndef MILD_ENGINE_INERTIA_H
#define MILD_ENGINE_INERTIA_H

#include "engine/data.h"

/* Adds to `sum`, about its own point, an inertia whose point lies `arm` away from that. */
MILD_HD void inertia_add(Real *sum, const Real *inertia, const Real *arm) {
    const Real mass = inertia[INERTIA_MASS];
    const Real *moment = inertia + INERTIA_MOMENT;
    const Real *tensor = inertia + INERTIA_TENSOR;
    Real both[3]; /* 2 moment + mass arm, half of which goes with arm */
    for (int k = 0; k < 3; k++) {
        both[k] = 2 * moment[k] + mass * arm[k];
    }
    const Real trace = dot3(arm, both);
    sum[INERTIA_MASS] += mass;
    for (int k = 0; k < 3; k++) {
        sum[INERTIA_MOMENT + k] += moment[k] + mass * arm[k];
        sum[INERTIA_TENSOR + k] += tensor[k] + trace - arm[k] * both[k];
    }
    sum[INERTIA_TENSOR + 3] += tensor[3] - (arm[0] * both[1] + arm[1] * both[0]) / 2;
    sum[INERTIA_TENSOR + 4] += tensor[4] - (arm[0] * both[2] + arm[2] * both[0]) / 2;
    sum[INERTIA_TENSOR + 5] += tensor[5] - (arm[1] * both[2] + arm[2] * both[1]) / 2;
}

/* [m] Centre of mass of the base's own body in the base's frame, as varied. */
MILD_HD void base_center(const EngineModel *model, const EngineVariation *variation, Real *center) {
    for (int k = 0; k < 3; k++) {
        center[k] = model->number.base_center[k] + variation->center_offset[k];
    }
}

/* The base's own body: mass added, inertia about the centre of mass in proportion to mass. */
MILD_HD void base_inertia(const EngineModel *model, const EngineVariation *variation,
                          Real *inertia) {
    const EngineNumbers *n = &model->number;
    const Real mass = n->base_mass * variation->link_mass_scale[0] + variation->base_mass_add;
    Real at_center[INERTIA_NUMBERS] = {mass, 0, 0, 0};
    Real center[3];
    for (int k = 0; k < 6; k++) {
        at_center[INERTIA_TENSOR + k] = mass / n->base_mass * n->base_inertia[k];
    }
    base_center(model, variation, center);
    inertia_add(inertia, at_center, center);
}

/* From link axes to world axes. */
MILD_HD void inertia_turn(const Real *R, const Real *own, Real *world) {
    const Real *S = own + INERTIA_TENSOR;
    Real half[9]; /* R S */
    world[INERTIA_MASS] = own[INERTIA_MASS];
    turn3(R, own + INERTIA_MOMENT, world + INERTIA_MOMENT);
    for (int r = 0; r < 3; r++) {
        symmetric3(S, R + 3 * r, half + 3 * r);
    }
    Real *out = world + INERTIA_TENSOR;
    out[0] = dot3(half, R);
    out[1] = dot3(half + 3, R + 3);
    out[2] = dot3(half + 6, R + 6);
    out[3] = dot3(half, R + 3);
    out[4] = dot3(half, R + 6);
    out[5] = dot3(half + 3, R + 6);
}

LANE_FN void engine_link_inertia(const EngineModel *model, const EngineVariation *variation,
                                 EngineWork *work) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = LANE(l); i < engine_links(&model->tree); i += LANES) {
            const EngineLink *link = &model->number.link[i];
            const Real scale = variation->link_mass_scale[model->tree.scale[i]];
            Real own[INERTIA_NUMBERS];
            for (int k = 0; k < INERTIA_NUMBERS; k++) {
                own[k] = link->welded[k] + (i == 0 ? 0 : scale * link->inertia[k]);
            }
            if (i == 0) {
                base_inertia(model, variation, own);
            }
            inertia_turn(work->rotation[i], own, work->now.dynamics.inertia[i]);
        }
    }
    lanes_meet();
}

/* Each link takes up the inertia of all that hangs on it, deepest level first. A lane has a parent,
 * so that no two add to one sum. */
LANE_FN void engine_composite_inertia(const EngineModel *model, EngineWork *work) {
    const EngineTree *tree = &model->tree;
    LANE_ROLLED
    for (int level = tree->levels - 1; level > 0; level--) {
        const int begin = tree->level_begin[level - 1];
        const int middle = tree->level_begin[level];
        const int end = tree->level_begin[level + 1];
        EACH_LANE(l) {
            LANE_ROLLED
            for (int n = begin + LANE(l); n < middle; n += LANES) {
                const int parent = tree->level_link[n];
                LANE_ROLLED
                for (int c = middle; c < end; c++) {
                    const int child = tree->level_link[c];
                    if (tree->parent[child] != parent) {
                        continue;
                    }
                    Real arm[3];
                    for (int k = 0; k < 3; k++) {
                        arm[k] = work->position[child][k] - work->position[parent][k];
                    }
                    inertia_add(work->now.dynamics.inertia[parent],
                                work->now.dynamics.inertia[child], arm);
                }
            }
        }
        lanes_meet();
    }
}

/* What accelerates degree of freedom d by 1 with all behind it rigid: force, and torque about its
 * anchor. */
MILD_HD void engine_unit_force(const EngineWork *work, int d, Real *out) {
    const int i = d < 6 ? 0 : d - 5;
    const Real *inertia = work->now.dynamics.inertia[i];
    const Real *moment = inertia + INERTIA_MOMENT;
    const Real *R = work->rotation[0];
    if (d < 3) {
        Real unit[3];
        for (int k = 0; k < 3; k++) {
            unit[k] = k == d ? REAL(1) : REAL(0);
            out[k] = inertia[INERTIA_MASS] * unit[k];
        }
        cross3(moment, unit, out + 3);
    } else {
        Real axis[3];
        for (int k = 0; k < 3; k++) {
            axis[k] = d < 6 ? R[3 * k + d - 3] : work->axis[i][k];
        }
        cross3(axis, moment, out);
        symmetric3(inertia + INERTIA_TENSOR, axis, out + 3);
    }
}

/* Entry of M: what the unit force of one degree of freedom does along an ancestor. */
MILD_HD Real engine_mass_entry(const EngineModel *model, const EngineVariation *variation,
                               const EngineWork *work, int d, int place) {
    const EngineTree *tree = &model->tree;
    const Real *unit = work->now.dynamics.unit[d];
    const Real *R = work->rotation[0];
    const int i = d < 6 ? 0 : d - 5;
    if (place < 3) {
        return unit[place];
    }
    const int j = place < 6 ? 0 : tree->ancestor[i][place - 5];
    Real arm[3];
    Real torque[3] = {unit[3], unit[4], unit[5]};
    for (int k = 0; k < 3; k++) {
        arm[k] = work->position[i][k] - work->position[j][k];
    }
    add_cross3(arm, unit, torque);
    if (j == 0) {
        return R[place - 3] * torque[0] + R[place] * torque[1] + R[place + 3] * torque[2];
    }
    const EngineLink *link = &model->number.link[i];
    const Real rotor =
        variation->armature_scale * link->armature + model->number.dt * link->damping;
    return dot3(work->axis[j], torque) + (j == i ? rotor : 0);
}

/* M. Armature adds to the diagonal, and so does dt damping: MuJoCo's Euler integrator takes damping
 * at the end of the step. */
LANE_FN void engine_mass_matrix(const EngineModel *model, const EngineVariation *variation,
                                EngineWork *work) {
    const EngineTree *tree = &model->tree;
    engine_composite_inertia(model, work);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            engine_unit_force(work, d, work->now.dynamics.unit[d]);
        }
    }
    lanes_meet();
    EACH_LANE(l) {
        LANE_ROLLED
        for (int e = LANE(l); e < engine_entries(tree); e += LANES) {
            work->mass[e] =
                engine_mass_entry(model, variation, work, tree->entry_dof[e], tree->entry_place[e]);
        }
    }
    lanes_meet();
}

#endif
