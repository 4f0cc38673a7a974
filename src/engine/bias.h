/* What the robot's motion and weight ask of the joints: recursive Newton-Euler (Featherstone 2008,
 * section 5.3) with qacc = 0, in world axes. */
#ifndef MILD_ENGINE_BIAS_H
#define MILD_ENGINE_BIAS_H

#include "engine/inertia.h"

/* Motion of a link from that of its parent. The accelerations are those of the material points,
 * less gravity. */
MILD_HD void engine_link_motion(const EngineModel *model, EngineWork *work, int i) {
    EngineDynamics *now = &work->now.dynamics;
    const int parent = model->tree.parent[i];
    const Real *spin = now->spin[parent];
    Real arm[3];
    Real turn[3]; /* [rad/s] of the hinge */
    Real sweep[3];
    for (int k = 0; k < 3; k++) {
        arm[k] = work->position[i][k] - work->position[parent][k];
        turn[k] = work->rate[5 + i] * work->axis[i][k];
        now->spin[i][k] = spin[k] + turn[k];
        now->spin_rate[i][k] = now->spin_rate[parent][k];
        now->acceleration[i][k] = now->acceleration[parent][k];
    }
    add_cross3(spin, turn, now->spin_rate[i]);
    cross3(spin, arm, sweep);
    add_cross3(now->spin_rate[parent], arm, now->acceleration[i]);
    add_cross3(spin, sweep, now->acceleration[i]);
}

/* Newton and Euler: the force and torque about the anchor that this motion takes. */
MILD_HD void engine_link_force(EngineWork *work, int i) {
    EngineDynamics *now = &work->now.dynamics;
    const Real *inertia = now->inertia[i];
    const Real *moment = inertia + INERTIA_MOMENT;
    const Real *spin = now->spin[i];
    Real *force = now->force[i];
    Real *torque = force + 3;
    Real sweep[3];
    Real momentum[3];
    cross3(spin, moment, sweep);
    for (int k = 0; k < 3; k++) {
        force[k] = inertia[INERTIA_MASS] * now->acceleration[i][k];
    }
    add_cross3(now->spin_rate[i], moment, force);
    add_cross3(spin, sweep, force);
    symmetric3(inertia + INERTIA_TENSOR, now->spin_rate[i], torque);
    symmetric3(inertia + INERTIA_TENSOR, spin, momentum);
    add_cross3(spin, momentum, torque);
    add_cross3(moment, now->acceleration[i], torque);
}

/* Adds to a link's force those of the links on it. */
MILD_HD void engine_gather_force(const EngineTree *tree, EngineWork *work, int parent, int begin,
                                 int end) {
    EngineDynamics *now = &work->now.dynamics;
    LANE_ROLLED
    for (int c = begin; c < end; c++) {
        const int child = tree->level_link[c];
        if (tree->parent[child] != parent) {
            continue;
        }
        Real arm[3];
        for (int k = 0; k < 3; k++) {
            arm[k] = work->position[child][k] - work->position[parent][k];
            now->force[parent][k] += now->force[child][k];
            now->force[parent][3 + k] += now->force[child][3 + k];
        }
        add_cross3(arm, now->force[child], now->force[parent] + 3);
    }
}

LANE_FN void engine_link_forces(const EngineModel *model, EngineWork *work) {
    const EngineTree *tree = &model->tree;
    EngineDynamics *now = &work->now.dynamics;
    EACH_LANE(l) {
        for (int k = LANE(l); k < 3; k += LANES) {
            now->spin[0][k] = dot3(work->rotation[0] + 3 * k, work->rate + 3);
            now->spin_rate[0][k] = 0;
            now->acceleration[0][k] = -model->number.gravity[k];
        }
    }
    lanes_meet();
    LANE_ROLLED
    for (int level = 1; level < tree->levels; level++) {
        EACH_LANE(l) {
            LANE_ROLLED
            for (int n = tree->level_begin[level] + LANE(l); n < tree->level_begin[level + 1];
                 n += LANES) {
                engine_link_motion(model, work, tree->level_link[n]);
            }
        }
        lanes_meet();
    }
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = LANE(l); i < engine_links(tree); i += LANES) {
            engine_link_force(work, i);
        }
    }
    lanes_meet();
    LANE_ROLLED
    for (int level = tree->levels - 1; level > 0; level--) {
        EACH_LANE(l) {
            LANE_ROLLED
            for (int n = tree->level_begin[level - 1] + LANE(l); n < tree->level_begin[level];
                 n += LANES) {
                engine_gather_force(tree, work, tree->level_link[n], tree->level_begin[level],
                                    tree->level_begin[level + 1]);
            }
        }
        lanes_meet();
    }
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

/* work->force: joint torques [joints] in the order of robot.ini, less gyroscopic, Coriolis and
 * gravity forces and damping, and the push [6] or NULL. Before the inertias become composite. */
LANE_FN void engine_smooth_force(const EngineModel *model, const EngineVariation *variation,
                                 const Real *torque, const Real *push, EngineWork *work) {
    const EngineTree *tree = &model->tree;
    const Real(*force)[6] = (const Real(*)[6])work->now.dynamics.force;
    const Real *R = work->rotation[0];
    engine_link_forces(model, work);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            Real sum = 0;
            if (d < 3) {
                sum = -force[0][d];
            } else if (d < 6) {
                sum = -(R[d - 3] * force[0][3] + R[d] * force[0][4] + R[d + 3] * force[0][5]);
            } else {
                const int i = d - 5;
                sum = torque[tree->joint[i]] - dot3(work->axis[i], force[i] + 3) -
                      model->number.link[i].damping * work->rate[d];
            }
            if (push && d < 6) {
                sum += engine_push_force(model, variation, work, push, d);
            }
            work->force[d] = sum;
        }
    }
    lanes_meet();
}

#endif
