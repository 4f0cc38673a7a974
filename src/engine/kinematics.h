/* Where the links are: from the joints' angles to world poses. */
#ifndef MILD_ENGINE_KINEMATICS_H
#define MILD_ENGINE_KINEMATICS_H

#include "engine/data.h"

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

/* Rotation of each link in its parent's frame. A turn about a fixed axis is 1, cosine and sine
 * times three constant matrices, so a lane computes an entry without knowing the axis. */
LANE_FN void engine_hinges(const EngineModel *model, EngineWork *work) {
    EngineDynamics *now = &work->now.dynamics;
    const int links = engine_links(&model->tree);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = 1 + LANE(l); i < links; i += LANES) {
            const Real angle = work->angle[i] - model->number.link[i].reference;
            real_sine_cosine(angle, &now->wave[i][1], &now->wave[i][0]);
        }
    }
    lanes_meet();
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = 9 + LANE(l); n < 9 * links; n += LANES) {
            const int i = n / 9;
            const int e = n % 9;
            const EngineLink *link = &model->number.link[i];
            now->local[i][e] = link->turn[0][e] + now->wave[i][0] * link->turn[1][e] +
                               now->wave[i][1] * link->turn[2][e];
        }
        if (LANE(l) == 0) {
            quaternion_matrix(work->quaternion, work->rotation[0]);
            for (int k = 0; k < 3; k++) {
                work->position[0][k] = 0;
                work->axis[0][k] = 0;
            }
        }
    }
    lanes_meet();
}

/* One number of the pose of link i: nine of the rotation, three of the position. */
MILD_HD void engine_pose_number(const EngineModel *model, EngineWork *work, int i, int e) {
    const int parent = model->tree.parent[i];
    const Real *R = work->rotation[parent];
    if (e < 9) {
        const Real *local = work->now.dynamics.local[i];
        const int row = 3 * (e / 3);
        const int column = e % 3;
        work->rotation[i][e] = R[row] * local[column] + R[row + 1] * local[3 + column] +
                               R[row + 2] * local[6 + column];
    } else {
        const int k = e - 9;
        work->position[i][k] =
            work->position[parent][k] + dot3(R + 3 * k, model->number.link[i].anchor);
    }
}

/* Level by level, twelve lanes a link. */
LANE_FN void engine_kinematics(const EngineModel *model, EngineWork *work) {
    const EngineTree *tree = &model->tree;
    engine_hinges(model, work);
    LANE_ROLLED
    for (int level = 1; level < tree->levels; level++) {
        const int begin = tree->level_begin[level];
        const int numbers = 12 * (tree->level_begin[level + 1] - begin);
        EACH_LANE(l) {
            LANE_ROLLED
            for (int n = LANE(l); n < numbers; n += LANES) {
                engine_pose_number(model, work, tree->level_link[begin + n / 12], n % 12);
            }
        }
        lanes_meet();
    }
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = 3 + LANE(l); n < 3 * engine_links(tree); n += LANES) {
            const int i = n / 3;
            work->axis[i][n % 3] =
                dot3(work->rotation[i] + 3 * (n % 3), model->number.link[i].axis);
        }
    }
    lanes_meet();
}

#endif
