/* Where the links are: from the joints' angles to world poses. */
#ifndef MILD_ENGINE_KINEMATICS_H
#define MILD_ENGINE_KINEMATICS_H

#include "robot/engine/data.h"

/* Rotation matrix of a unit quaternion. */
MILD_HD void quaternion_matrix(const Real *q, Real *R) {
    const Real w = q[0];
    const Real x = q[1];
    const Real y = q[2];
    const Real z = q[3];
    R[0] = w * w + x * x - y * y - z * z;
    R[1] = 2 * (x * y - w * z);
    R[2] = 2 * (x * z + w * y);
    R[3] = 2 * (x * y + w * z);
    R[4] = w * w - x * x + y * y - z * z;
    R[5] = 2 * (y * z - w * x);
    R[6] = 2 * (x * z - w * y);
    R[7] = 2 * (y * z + w * x);
    R[8] = w * w - x * x - y * y + z * z;
}

/* A link in its parent's frame. */
MILD_HD void engine_hinge(const EngineLink *link, Real angle, Real *local) {
    Real sine;
    Real cosine;
    real_sine_cosine(angle - link->reference, &sine, &cosine);
    for (int k = 0; k < 12; k += 4) {
        Real still[4];
        Real with_cosine[4];
        Real with_sine[4];
        load4(link->turn[0] + k, still);
        load4(link->turn[1] + k, with_cosine);
        load4(link->turn[2] + k, with_sine);
        for (int c = 0; c < 3; c++) {
            still[c] = still[c] + cosine * with_cosine[c] + sine * with_sine[c];
        }
        store4(still, local + k);
    }
}

/* The base in the world, and each link in its parent's frame. */
WARP_FN void engine_hinges(const EngineModel *model, EngineWork *work) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = LANE(l); i < engine_links(&model->tree); i += LANES) {
            if (i > 0) {
                engine_hinge(&model->number.link[i], work->angle[i],
                             work->now.dynamics.of.local[i]);
                continue;
            }
            quaternion_matrix(work->quaternion, work->rotation[0]);
            for (int k = 0; k < 3; k++) {
                work->position[0][k] = 0;
                work->axis[0][k] = 0;
            }
        }
    }
    lanes_sync();
}

/* Row k of the rotations, and component k of the positions, from the base down to a leaf. */
MILD_HD void engine_chain_row(const EngineTree *tree, EngineWork *work, int leaf, int k) {
    EngineDynamics *now = &work->now.dynamics;
    const EngineIndex *dof = tree->row_dof[leaf] + 6;
    Real *rotation = work->rotation[0] + 3 * k;
    Real *position = work->position[0] + k;
    Real *arm = now->arm[0] + k;
    Real row[3] = {rotation[0], rotation[1], rotation[2]};
    Real place = 0;
    LANE_ROLLED
    for (int level = tree->level[leaf]; level > 0; level--) {
        const int i = *dof++ - 5;
        Real local[3][4];
        Real next[4];
        for (int m = 0; m < 3; m++) {
            load4(now->of.local[i] + 4 * m, local[m]);
        }
        for (int c = 0; c < 4; c++) {
            next[c] = row[0] * local[0][c] + row[1] * local[1][c] + row[2] * local[2][c];
        }
        for (int c = 0; c < 3; c++) {
            rotation[9 * i + c] = row[c] = next[c];
        }
        arm[3 * i] = next[3];
        position[3 * i] = place = place + next[3];
    }
}

/* A row of a rotation follows from the same row of the parent's, so a lane takes one down a chain
 * without the others. Links that several chains share get the same numbers several times. */
WARP_FN void engine_kinematics(const EngineModel *model, EngineWork *work) {
    const EngineTree *tree = &model->tree;
    engine_hinges(model, work);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < 3 * tree->leaves; n += LANES) {
            engine_chain_row(tree, work, tree->leaf[n / 3], n % 3);
        }
    }
    lanes_sync();
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = 1 + LANE(l); i < engine_links(tree); i += LANES) {
            turn3(work->rotation[i], model->number.link[i].axis, work->axis[i]);
        }
    }
    lanes_sync();
}

#endif
