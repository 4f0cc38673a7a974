/* Contact between the legs (robot/legs.h). While they are apart it costs a distance for each pair
 * of capsules. */
#ifndef MILD_ENGINE_LEGS_H
#define MILD_ENGINE_LEGS_H

#include "robot/engine/feet.h"

/* Capsule c from the base's origin, in world axes. */
MILD_HD void leg_capsule(const EngineModel *model, const EngineWork *work, int c,
                         LegCapsule *capsule) {
    const LegCapsule *from = &model->number.capsule[c];
    const int link = model->tree.capsule_link[c];
    const Real *R = work->rotation[link];
    turn3(R, from->center, capsule->center);
    turn3(R, from->half, capsule->half);
    for (int k = 0; k < 3; k++) {
        capsule->center[k] += work->position[link][k];
    }
    capsule->radius = from->radius;
}

/* The gap of pair n; nearer: bool, only if the capsules may touch. */
MILD_HD void leg_gap(const EngineModel *model, const EngineWork *work, int n, int nearer,
                     LegGap *gap) {
    const Real *R = work->rotation[0];
    const Real across[3] = {R[1], R[4], R[7]};
    LegCapsule a;
    LegCapsule b;
    leg_capsule(model, work, model->tree.leg_pair[n][0], &a);
    leg_capsule(model, work, model->tree.leg_pair[n][1], &b);
    gap->gap = LEGS_APART;
    if (!nearer || legs_near(&a, &b)) {
        legs_gap(&a, &b, across, gap);
    }
}

/* [m] Least distance of two legs; LEGS_APART where there are none. */
WARP_FN Real engine_leg_distance(const EngineModel *model, const EngineWork *work) {
    Real most[LANE_COPIES];
    EACH_LANE(l) {
        most[l] = -LEGS_APART;
        LANE_ROLLED
        for (int n = LANE(l); n < model->tree.leg_pairs; n += LANES) {
            LegGap gap;
            leg_gap(model, work, n, 0, &gap);
            most[l] = real_max(most[l], -gap.gap);
        }
    }
    return -lane_max(most);
}

/* Rate of the gap per unit of degree of freedom d: of the hinges of either leg. */
MILD_HD Real leg_row(const EngineTree *tree, const EngineWork *work, int n, const LegGap *gap,
                     int d) {
    const int a = 5 + tree->capsule_link[tree->leg_pair[n][0]];
    const int b = 5 + tree->capsule_link[tree->leg_pair[n][1]];
    const int side = ((b >= d) & (b < tree->behind[d])) - ((a >= d) & (a < tree->behind[d]));
    const int link = engine_dof_link(d);
    Real arm[3];
    Real move[3];
    if (d < 6 || side == 0) {
        return 0;
    }
    for (int k = 0; k < 3; k++) {
        arm[k] = gap->point[k] - work->position[link][k];
    }
    cross3(work->axis[link], arm, move);
    return (Real)side * dot3(gap->normal, move);
}

/* What pair n does to work->acceleration, which is L^-T force here. */
WARP_FN void engine_push_pair(const EngineModel *model, int n, EngineWork *work) {
    const EngineTree *tree = &model->tree;
    Real *row = work->now.support.change;
    LegGap gap;
    Real rate[LANE_COPIES];
    Real mobility[LANE_COPIES];
    leg_gap(model, work, n, 0, &gap);
    EACH_LANE(l) {
        rate[l] = 0;
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            row[d] = leg_row(tree, work, n, &gap, d);
            rate[l] += row[d] * work->rate[d];
        }
    }
    lanes_sync();
    engine_solve_transposed(tree, work->factor[0], work->inverse, row);
    EACH_LANE(l) {
        mobility[l] = 0;
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            mobility[l] += row[d] * row[d];
        }
    }
    const Real force = legs_force(model->number.dt, gap.gap, lane_sum(rate),
                                  lane_sum(mobility) + model->number.leg_softness);
    if (!(force > 0)) {
        return;
    }
    EACH_LANE(l) {
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            work->acceleration[d] += force * row[d];
        }
    }
    lanes_sync();
}

/* Forces of the pairs that meet, one after the other, in work->acceleration. After M's factor,
 * between engine_solve_transposed and engine_feet_pose. */
WARP_FN void engine_legs_push(const EngineModel *model, EngineWork *work) {
    const int pairs = model->tree.leg_pairs;
    Real *depth = work->now.support.jacobian[0][0]; /* [pairs], which is not filled yet */
    Real deepest[LANE_COPIES];
    EACH_LANE(l) {
        deepest[l] = -LEGS_APART;
        LANE_ROLLED
        for (int n = LANE(l); n < pairs; n += LANES) {
            LegGap gap;
            leg_gap(model, work, n, 1, &gap);
            depth[n] = -gap.gap;
            deepest[l] = real_max(deepest[l], -gap.gap);
        }
    }
    lanes_sync();
    if (!(lane_max(deepest) > -LEGS_NEAR)) {
        return;
    }
    LANE_ROLLED
    for (int n = 0; n < pairs; n++) {
        if (depth[n] > -LEGS_NEAR) {
            engine_push_pair(model, n, work);
        }
    }
}

#endif
