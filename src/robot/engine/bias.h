/* What the robot's motion and weight ask of the joints: recursive Newton-Euler (Featherstone 2008,
 * section 5.3) with qacc = 0, in world axes. */
#ifndef MILD_ENGINE_BIAS_H
#define MILD_ENGINE_BIAS_H

#include "robot/engine/inertia.h"

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
