/* Where the links are: from the joints' angles to world poses. */
#ifndef MILD_ENGINE_KINEMATICS_H
#define MILD_ENGINE_KINEMATICS_H

#include "engine/data.h"

/* Row k of the rotation matrix of a unit quaternion. */
MILD_HD void quaternion_row(const Real *q, int k, Real *row) {
    const int i = k == 2 ? 0 : k + 1;
    const int j = k == 0 ? 2 : k - 1;
    const Real w = q[0];
    const Real x = q[1 + k];
    const Real y = q[1 + i];
    const Real z = q[1 + j];
    row[k] = w * w + x * x - y * y - z * z;
    row[i] = 2 * (x * y - w * z);
    row[j] = 2 * (x * z + w * y);
}

MILD_HD void quaternion_matrix(const Real *q, Real *R) {
    for (int k = 0; k < 3; k++) {
        quaternion_row(q, k, R + 3 * k);
    }
}

/* Each link in its parent's frame, and the base. A turn about a fixed axis is 1, cosine and sine
 * times three constant matrices, so a lane computes a row without knowing the axis. */
LANE_FN void engine_hinges(const EngineModel *model, EngineWork *work) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < 3 * engine_links(&model->tree); n += LANES) {
            const int i = n / 3;
            const int k = n % 3;
            const EngineLink *link = &model->number.link[i];
            Real part[3][4];
            Real row[4];
            Real sine;
            Real cosine;
            if (i == 0) {
                quaternion_row(work->quaternion, k, work->rotation[0] + 3 * k);
                work->position[0][k] = work->axis[0][k] = 0;
                continue;
            }
            real_sine_cosine(work->angle[i] - link->reference, &sine, &cosine);
            for (int m = 0; m < 3; m++) {
                load4(link->turn[m] + 4 * k, part[m]);
            }
            for (int c = 0; c < 4; c++) {
                row[c] = part[0][c] + cosine * part[1][c] + sine * part[2][c];
            }
            store4(row, work->now.dynamics.of.local[i] + 4 * k);
        }
    }
    lanes_meet();
}

/* Row k of the rotations, and component k of the positions, from the base down to a leaf. */
MILD_HD void engine_chain_row(const EngineTree *tree, EngineWork *work, int leaf, int k) {
    EngineDynamics *now = &work->now.dynamics;
    Real row[3];
    Real position = 0;
    for (int c = 0; c < 3; c++) {
        row[c] = work->rotation[0][3 * k + c];
    }
    LANE_ROLLED
    for (int place = 6; place < engine_row_length(tree, leaf); place++) {
        const int i = tree->row_dof[leaf][place] - 5;
        Real local[3][4];
        Real next[4];
        for (int m = 0; m < 3; m++) {
            load4(now->of.local[i] + 4 * m, local[m]);
        }
        for (int c = 0; c < 4; c++) {
            next[c] = row[0] * local[0][c] + row[1] * local[1][c] + row[2] * local[2][c];
        }
        for (int c = 0; c < 3; c++) {
            work->rotation[i][3 * k + c] = row[c] = next[c];
        }
        now->arm[i][k] = next[3];
        work->position[i][k] = position = position + next[3];
    }
}

/* A row of a rotation follows from the same row of the parent's, so a lane takes one down a chain
 * without the others. Links that several chains share get the same numbers several times. */
LANE_FN void engine_kinematics(const EngineModel *model, EngineWork *work) {
    const EngineTree *tree = &model->tree;
    engine_hinges(model, work);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < 3 * tree->leaves; n += LANES) {
            engine_chain_row(tree, work, tree->leaf[n / 3], n % 3);
        }
    }
    lanes_meet();
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = 1 + LANE(l); i < engine_links(tree); i += LANES) {
            turn3(work->rotation[i], model->number.link[i].axis, work->axis[i]);
        }
    }
    lanes_meet();
}

#endif
