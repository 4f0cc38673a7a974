/* M and the forces of the robot's motion and weight, in world axes. */
#ifndef MILD_ENGINE_DYNAMICS_H
#define MILD_ENGINE_DYNAMICS_H

#include "robot/engine/data.h"

/* ---- inertia ---- */

/* Inertia of the links, and M by the method of composite rigid bodies (Featherstone,
 * Rigid Body Dynamics Algorithms, 2008, section 6.2).
 *
 * Each inertia is about the anchor of its own hinge. About one common point the small moments of a
 * foot would be differences of large ones, which float does not have. */

/* Adds to `sum`, about its own point, an inertia whose point lies `arm` away from that. */
MILD_HD void inertia_add(Real *sum, const Real *inertia, const Real *arm) {
    const Real mass = inertia[INERTIA_MASS];
    const Real *moment = inertia + INERTIA_MOMENT;
    const Real *tensor = inertia + INERTIA_TENSOR;
    Real *total = sum + INERTIA_TENSOR;
    Real shifted[3]; /* moment about the sum's point */
    Real both[3];
    for (int k = 0; k < 3; k++) {
        shifted[k] = moment[k] + mass * arm[k];
        both[k] = moment[k] + shifted[k];
        sum[INERTIA_MOMENT + k] += shifted[k];
    }
    sum[INERTIA_MASS] += mass;
    total[0] = total[0] + tensor[0] + arm[1] * both[1] + arm[2] * both[2];
    total[1] = total[1] + tensor[1] + arm[0] * both[0] + arm[2] * both[2];
    total[2] = total[2] + tensor[2] + arm[0] * both[0] + arm[1] * both[1];
    total[3] = total[3] + tensor[3] - moment[0] * arm[1] - arm[0] * shifted[1];
    total[4] = total[4] + tensor[4] - moment[0] * arm[2] - arm[0] * shifted[2];
    total[5] = total[5] + tensor[5] - moment[1] * arm[2] - arm[1] * shifted[2];
}

/* [m] Centre of mass of the base's own body in the base's frame, as varied. */
MILD_HD void base_center(const EngineModel *model, const EngineVariation *variation, Real *center) {
    for (int k = 0; k < 3; k++) {
        center[k] = model->number.base_center[k] + variation->center_offset[k];
    }
}

/* Adds the base's own body: mass added, inertia about the centre of mass in proportion to mass. */
MILD_HD void base_inertia(const EngineModel *model, const EngineVariation *variation, Real *sum) {
    const EngineNumbers *n = &model->number;
    const Real mass = n->base_mass * variation->link_mass_scale[0] + variation->base_mass_add;
    const Real scale = mass / n->base_mass;
    Real *tensor = sum + INERTIA_TENSOR;
    Real center[3];
    Real moment[3];
    base_center(model, variation, center);
    for (int k = 0; k < 3; k++) {
        moment[k] = mass * center[k];
        sum[INERTIA_MOMENT + k] += moment[k];
    }
    const Real trace = dot3(center, moment);
    sum[INERTIA_MASS] += mass;
    for (int k = 0; k < 3; k++) {
        tensor[k] += scale * n->base_inertia[k] + trace - center[k] * moment[k];
    }
    tensor[3] += scale * n->base_inertia[3] - center[0] * moment[1];
    tensor[4] += scale * n->base_inertia[4] - center[0] * moment[2];
    tensor[5] += scale * n->base_inertia[5] - center[1] * moment[2];
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

/* Inertia of link i about its anchor, world axes. */
MILD_HD void engine_link_inertia(const EngineModel *model, const EngineVariation *variation,
                                 const EngineWork *work, int i, Real *inertia) {
    const EngineLink *link = &model->number.link[i];
    const Real scale = i == 0 ? 0 : variation->link_mass_scale[model->tree.scale[i]];
    Real own[INERTIA_NUMBERS];
    for (int k = 0; k < INERTIA_NUMBERS; k++) {
        own[k] = link->welded[k] + scale * link->inertia[k];
    }
    if (i == 0) {
        base_inertia(model, variation, own);
    }
    inertia_turn(work->rotation[i], own, inertia);
}

/* Sums of the links from `begin` to before `end` about the anchor of link i. */
MILD_HD void engine_gather_links(const EngineWork *work, int i, int begin, int end, Real *total) {
    Real sum[LINK_NUMBERS];
    Real own[3];
    for (int k = 0; k < LINK_NUMBERS; k++) {
        sum[k] = 0;
    }
    for (int k = 0; k < 3; k++) {
        own[k] = work->position[i][k];
    }
    LANE_ROLLED
    for (int j = begin; j < end; j++) {
        Real number[LINK_NUMBERS];
        Real arm[3];
        for (int k = 0; k < LINK_NUMBERS; k += 4) {
            load4(work->now.dynamics.link[j] + k, number + k);
        }
        for (int k = 0; k < 3; k++) {
            arm[k] = work->position[j][k] - own[k];
            sum[LINK_FORCE + k] += number[LINK_FORCE + k];
            sum[LINK_TORQUE + k] += number[LINK_TORQUE + k];
        }
        inertia_add(sum, number, arm);
        add_cross3(arm, number + LINK_FORCE, sum + LINK_TORQUE);
    }
    for (int k = 0; k < LINK_NUMBERS; k += 4) {
        store4(sum + k, total + k);
    }
}

/* Inertia and force of each link with all that hangs on it, rigid. The base would be the longest
 * sum, so it is taken in as many parts as links hang on it. */
WARP_FN void engine_gather(const EngineTree *tree, EngineWork *work) {
    EngineDynamics *now = &work->now.dynamics;
    const int links = engine_links(tree);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = 1 + LANE(l); n < links + tree->base_links; n += LANES) {
            const int begin = n < links ? n : tree->base_link[n - links];
            engine_gather_links(work, n < links ? n : 0, begin, tree->end[begin], now->of.total[n]);
        }
    }
    lanes_sync();
    EACH_LANE(l) {
        if (LANE(l) < LINK_NUMBERS) {
            Real sum = now->link[0][LANE(l)];
            LANE_ROLLED
            for (int n = links; n < links + tree->base_links; n++) {
                sum += now->of.total[n][LANE(l)];
            }
            now->of.total[0][LANE(l)] = sum;
        }
    }
    lanes_sync();
}

/* What accelerates degree of freedom d by 1 with all behind it rigid: force, and torque about its
 * anchor. */
MILD_HD void engine_unit_force(const EngineWork *work, int d, Real *force, Real *torque) {
    const int i = engine_dof_link(d);
    const Real *inertia = work->now.dynamics.of.total[i];
    const Real *moment = inertia + INERTIA_MOMENT;
    const Real *R = work->rotation[0];
    Real axis[3]; /* of a turn */
    Real unit[3]; /* of a move */
    for (int k = 0; k < 3; k++) {
        const int turns = d - 3;
        axis[k] = d < 3 ? 0 : d < 6 ? R[3 * k + turns] : work->axis[i][k];
        unit[k] = k == d;
        force[k] = inertia[INERTIA_MASS] * unit[k];
    }
    add_cross3(axis, moment, force);
    symmetric3(inertia + INERTIA_TENSOR, axis, torque);
    add_cross3(moment, unit, torque);
}

/* Row d of M: what the unit force does along the ancestors, from anchor to anchor up to the base.
 * Armature adds to the diagonal, and so does dt damping: MuJoCo's Euler integrator takes damping at
 * the end of the step. */
MILD_HD void engine_mass_row(const EngineModel *model, const EngineVariation *variation,
                             EngineWork *work, int d) {
    const EngineTree *tree = &model->tree;
    const int i = engine_dof_link(d);
    const EngineLink *link = &model->number.link[i];
    const Real *R = work->rotation[0];
    Real *row = work->mass[d];
    Real force[3];
    Real torque[3];
    Real rotor = variation->armature_scale * link->armature + model->number.dt * link->damping;
    engine_unit_force(work, d, force, torque);
    LANE_ROLLED
    for (int place = tree->above[d]; place > 5; place--) {
        const int j = tree->row_dof[i][place] - 5;
        row[place] = rotor + dot3(work->axis[j], torque);
        add_cross3(work->now.dynamics.arm[j], force, torque);
        rotor = 0;
    }
    for (int k = 0; k < 3; k++) {
        row[k] = force[k];
        row[3 + k] = R[k] * torque[0] + R[3 + k] * torque[1] + R[6 + k] * torque[2];
    }
}

WARP_FN void engine_mass_matrix(const EngineModel *model, const EngineVariation *variation,
                                EngineWork *work) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(&model->tree); d += LANES) {
            engine_mass_row(model, variation, work, d);
        }
    }
    lanes_sync();
}

/* ---- bias ---- */

/* What the robot's motion and weight ask of the joints: recursive Newton-Euler (Featherstone 2008,
 * section 5.3) with qacc = 0. */

/* Motion of a link without qacc. Accelerations are those of material points less gravity. */
typedef struct {
    Real spin[3];         /* [rad/s] */
    Real spin_rate[3];    /* [rad/s^2] */
    Real acceleration[3]; /* [m/s^2] of the anchor, upward 9.81 at rest */
} EngineMotion;

/* Takes the motion of a parent to link i. */
MILD_HD void engine_descend(const EngineWork *work, int i, EngineMotion *motion) {
    const Real *arm = work->now.dynamics.arm[i];
    Real turn[3]; /* [rad/s] of the hinge */
    Real sweep[3];
    cross3(motion->spin, arm, sweep);
    add_cross3(motion->spin_rate, arm, motion->acceleration);
    add_cross3(motion->spin, sweep, motion->acceleration);
    for (int k = 0; k < 3; k++) {
        turn[k] = work->rate[5 + i] * work->axis[i][k];
    }
    add_cross3(motion->spin, turn, motion->spin_rate);
    for (int k = 0; k < 3; k++) {
        motion->spin[k] += turn[k];
    }
}

/* Motion of link i, from the base down. */
MILD_HD void engine_link_motion(const EngineModel *model, const EngineWork *work, int i,
                                EngineMotion *motion) {
    const EngineTree *tree = &model->tree;
    for (int k = 0; k < 3; k++) {
        motion->spin[k] = dot3(work->rotation[0] + 3 * k, work->rate + 3);
        motion->spin_rate[k] = 0;
        motion->acceleration[k] = -model->number.gravity[k];
    }
    LANE_ROLLED
    for (int place = 6; place < engine_row_length(tree, i); place++) {
        engine_descend(work, tree->row_dof[i][place] - 5, motion);
    }
}

/* Newton and Euler: the force and torque about the anchor that a motion takes. */
MILD_HD void engine_link_force(const Real *inertia, const EngineMotion *motion, Real *force,
                               Real *torque) {
    const Real *moment = inertia + INERTIA_MOMENT;
    Real sweep[3];
    Real momentum[3];
    cross3(motion->spin, moment, sweep);
    for (int k = 0; k < 3; k++) {
        force[k] = inertia[INERTIA_MASS] * motion->acceleration[k];
    }
    add_cross3(motion->spin_rate, moment, force);
    add_cross3(motion->spin, sweep, force);
    symmetric3(inertia + INERTIA_TENSOR, motion->spin_rate, torque);
    symmetric3(inertia + INERTIA_TENSOR, motion->spin, momentum);
    add_cross3(motion->spin, momentum, torque);
    add_cross3(moment, motion->acceleration, torque);
}

/* Inertia and force of each link by itself. A lane follows the motion down to its link, because
 * that takes no more instructions than a level of the tree after the other. */
WARP_FN void engine_link_forces(const EngineModel *model, const EngineVariation *variation,
                                EngineWork *work) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = LANE(l); i < engine_links(&model->tree); i += LANES) {
            EngineMotion motion;
            Real number[LINK_NUMBERS];
            engine_link_motion(model, work, i, &motion);
            engine_link_inertia(model, variation, work, i, number);
            engine_link_force(number, &motion, number + LINK_FORCE, number + LINK_TORQUE);
            for (int k = 0; k < LINK_NUMBERS; k += 4) {
                store4(number + k, work->now.dynamics.link[i] + k);
            }
        }
    }
    lanes_sync();
}

/* Force of a push on the base's centre of mass along degree of freedom d < 6. push: force and
 * torque, world axes. */
MILD_HD Real engine_push_force(const EngineModel *model, const EngineVariation *variation,
                               const EngineWork *work, const Real *push, int d) {
    const Real *R = work->rotation[0];
    Real center[3];
    Real arm[3];
    Real torque[3] = {push[3], push[4], push[5]};
    if (d < 3) {
        return push[d];
    }
    base_center(model, variation, center);
    turn3(R, center, arm);
    add_cross3(arm, push, torque);
    return R[d - 3] * torque[0] + R[d] * torque[1] + R[d + 3] * torque[2];
}

/* work->acceleration <- force: joint torques [joints] in the order of robot.ini, less gyroscopic,
 * Coriolis and gravity forces and damping, and the push [6] or NULL. After engine_gather. */
WARP_FN void engine_smooth_force(const EngineModel *model, const EngineVariation *variation,
                                 const Real *torque, const Real *push, EngineWork *work) {
    const EngineTree *tree = &model->tree;
    const Real *R = work->rotation[0];
    EACH_LANE(l) {
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            const int i = engine_dof_link(d);
            const Real *total = work->now.dynamics.of.total[i];
            const Real *bias = total + LINK_TORQUE;
            Real sum = 0;
            if (d < 3) {
                sum = -total[LINK_FORCE + d];
            } else if (d < 6) {
                sum = -(R[d - 3] * bias[0] + R[d] * bias[1] + R[d + 3] * bias[2]);
            } else {
                sum = torque[tree->joint[i]] - dot3(work->axis[i], bias) -
                      model->number.link[i].damping * work->rate[d];
            }
            if (push && d < 6) {
                sum += engine_push_force(model, variation, work, push, d);
            }
            work->acceleration[d] = sum;
        }
    }
    lanes_sync();
}

#endif
