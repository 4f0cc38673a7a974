/* The feet seen from the robot's degrees of freedom: poses, J, A = J M^-1 J^T and V_free, and back
 * from wrenches to accelerations. The wrench and twist of a foot refer to the origin of a flat
 * foot's body, the lowest point of a round foot. On soft ground a round foot transmits no moment,
 * so that the angular rows of A, V_free and its twist are 0, and its rotation is the identity. */
#ifndef MILD_ENGINE_FEET_H
#define MILD_ENGINE_FEET_H

#include "robot/engine/factor.h"

/* Components of a foot's twist and wrench that soft ground has to do with. */
MILD_HD int foot_parts(const EngineTree *tree, int foot) {
    return tree->foot_round[foot] ? 3 : 6;
}

/* Number e of the pose of a foot: nine of its rotation, three of its position, which counts from
 * the base here. */
MILD_HD void foot_pose_number(const EngineModel *model, EngineWork *work, int f, int e) {
    const int link = model->tree.foot_link[f];
    const EngineFoot *foot = &model->number.foot[f];
    const int k = e < 9 ? e / 3 : e - 9;
    const Real *row = work->rotation[link] + 3 * k;
    const Real *column = e < 9 ? foot->turn + e % 3 : foot->reference;
    const int step = e < 9 ? 3 : 1;
    const Real sum = row[0] * column[0] + row[1] * column[step] + row[2] * column[2 * step];
    if (e < 9) {
        work->foot_rotation[f][e] = model->tree.foot_round[f] ? (e % 4 == 0) : sum;
    } else {
        const Real lower = k == 2 ? foot->radius : 0;
        work->foot_position[f][k] = work->position[link][k] + sum - lower;
    }
}

/* Where the links are, as in EngineWork. */
typedef struct {
    const Real (*rotation)[9];
    const Real (*position)[3];
    const Real (*axis)[3];
} EngineLinks;

/* Twist of a point that moves with a link, [m] from the base, per unit of the degree of freedom at
 * a place of the link's row. */
MILD_HD void link_column(const EngineTree *tree, const EngineLinks *links, int link,
                         const Real *point, int place, Real *column) {
    const int j = engine_dof_link(tree->row_dof[link][place]);
    const int turns = place < 3 ? place : place - 3; /* column of the base's rotation */
    const Real *from = place < 6 ? links->rotation[0] + turns : links->axis[j];
    const int step = place < 6 ? 3 : 1;
    Real axis[3];
    Real arm[3];
    Real move[3];
    for (int k = 0; k < 3; k++) {
        axis[k] = from[step * k];
        arm[k] = point[k] - links->position[j][k];
    }
    cross3(axis, arm, move);
    for (int k = 0; k < 3; k++) {
        column[k] = place < 3 ? (place == k) : move[k];
        column[3 + k] = place < 3 ? 0 : axis[k];
    }
}

/* The same of a foot. */
MILD_HD void foot_column(const EngineTree *tree, EngineWork *work, int f, int place) {
    const EngineLinks links = {(const Real(*)[9])work->rotation, (const Real(*)[3])work->position,
                               (const Real(*)[3])work->axis};
    link_column(tree, &links, tree->foot_link[f], work->foot_position[f], place,
                work->now.support.jacobian[f][place]);
}

/* Component c of the twist of a foot at the velocity x. */
MILD_HD Real foot_twist(const EngineTree *tree, const EngineSupport *support, const Real *x,
                        int foot, int c) {
    const int link = tree->foot_link[foot];
    const Real *number = support->jacobian[foot][0] + c;
    Real sum = 0;
    ENGINE_LOOP
    for (int d = 0; d < 6; d++) {
        sum += number[6 * d] * x[d];
    }
    LANE_ROLLED
    for (int place = 6; place < tree->shared[foot][foot]; place++) {
        sum += number[6 * place] * x[tree->row_dof[link][place]];
    }
    return sum;
}

/* Poses and twists of the feet, and J. */
WARP_FN void engine_feet_pose(const EngineModel *model, EngineWork *work) {
    const EngineTree *tree = &model->tree;
    const int feet = engine_feet(tree);
    const int chain = engine_chain(tree);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < 12 * feet; n += LANES) {
            foot_pose_number(model, work, n / 12, n % 12);
        }
    }
    lanes_sync();
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < chain * feet; n += LANES) {
            const int f = n / chain;
            if (n % chain < tree->shared[f][f]) {
                foot_column(tree, work, f, n % chain);
            }
        }
    }
    lanes_sync();
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < 6 * feet; n += LANES) {
            const int f = n / 6;
            const int c = n % 6;
            work->foot_velocity[f][c] = c < foot_parts(tree, f)
                                            ? foot_twist(tree, &work->now.support, work->rate, f, c)
                                            : 0;
            if (c < 3) {
                work->foot_position[f][c] += work->base[c];
            }
        }
    }
    lanes_sync();
}

/* half <- L^-T J^T, and V_free = J (qvel + dt L^-1 y) = J qvel + dt half^T y, where y = L^-T force.
 * A lane has a column of a foot, whose chain is a path, so it needs no other lane. As in
 * engine_solve_transposed, a solved entry is taken from those above it. */
WARP_FN void engine_half_solve(const EngineModel *model, EngineWork *work) {
    const EngineTree *tree = &model->tree;
    EngineSupport *support = &work->now.support;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < 6 * engine_feet(tree); n += LANES) {
            const int f = n / 6;
            const int c = n % 6;
            const int link = tree->foot_link[f];
            const int length = tree->shared[f][f];
            const int part = c < foot_parts(tree, f);
            Real gain = 0;
            Real x[ENGINE_CHAIN];
            ENGINE_LOOP
            for (int place = 0; place < ENGINE_CHAIN; place++) {
                x[place] = part && place < length ? support->jacobian[f][place][c] : 0;
            }
            ENGINE_LOOP
            for (int k = ENGINE_CHAIN - 1; k >= 0; k--) {
                if (k < length) {
                    const int d = k < 6 ? k : tree->row_dof[link][k];
                    x[k] *= work->inverse[d];
                    support->half[f][k][c] = x[k];
                    gain += x[k] * work->acceleration[d];
                    ENGINE_LOOP
                    for (int place = 0; place < k; place++) {
                        x[place] -= work->factor[d][place] * x[k];
                    }
                }
            }
            support->free_velocity[f][c] = work->foot_velocity[f][c] + model->number.dt * gain;
        }
    }
    lanes_sync();
}

/* A = J M^-1 J^T, of two feet over the degrees of freedom that move both. A lane has a tile of two
 * rows and three columns. */
WARP_FN void engine_foot_inertia(const EngineTree *tree, EngineWork *work) {
    EngineSupport *support = &work->now.support;
    const int feet = engine_feet(tree);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < 3 * feet * 2 * feet; n += LANES) {
            const int row = n / (2 * feet);
            const int column = n % (2 * feet);
            const int f = row / 3;
            const int g = column / 2;
            const Real *left = support->half[f][0] + 2 * (row % 3);
            const Real *right = support->half[g][0] + 3 * (column % 2);
            Real *to = support->ground.inverse_inertia + 12 * feet * row + 3 * column;
            Real sum[2][3] = {{0, 0, 0}, {0, 0, 0}};
            LANE_ROLLED
            for (int place = tree->shared[f][g]; place > 0; place--) {
                for (int k = 0; k < 3; k++) {
                    sum[0][k] += left[0] * right[k];
                    sum[1][k] += left[1] * right[k];
                }
                left += 6;
                right += 6;
            }
            for (int k = 0; k < 3; k++) {
                to[k] = sum[0][k];
                to[6 * feet + k] = sum[1][k];
            }
        }
    }
    lanes_sync();
}

/* A and V_free: the robot as the feet see it. */
WARP_FN void engine_project_feet(const EngineModel *model, EngineWork *work) {
    engine_half_solve(model, work);
    engine_foot_inertia(&model->tree, work);
}

/* bool: a link moves with degree of freedom d. */
MILD_HD int link_moves(const EngineTree *tree, int link, int d) {
    const int hinge = 5 + link;
    return (hinge >= d) & (hinge < tree->behind[d]);
}

MILD_HD int foot_moves(const EngineTree *tree, int f, int d) {
    return link_moves(tree, tree->foot_link[f], d);
}

/* Degree of freedom d of the sum over the feet of rows^T wrench; rows [feet * chain][6]: J^T or
 * L^-T J^T. */
MILD_HD Real wrench_along(const EngineTree *tree, const EngineWork *work, const Real (*rows)[6],
                          int d) {
    const int above = tree->above[d];
    Real sum = 0;
    LANE_ROLLED
    for (int f = 0; f < engine_feet(tree); f++) {
        if (foot_moves(tree, f, d)) {
            const Real *row = rows[ENGINE_CHAIN * f + above];
            sum += dot3(row, work->wrench[f]) + dot3(row + 3, work->wrench[f] + 3);
        }
    }
    return sum;
}

/* acceleration <- L^-1 (L^-T force + the sum over the feet of half wrench): qacc with the wrenches
 * of soft ground, or without ground. wrenches: bool. */
WARP_FN void engine_accelerate(const EngineTree *tree, EngineWork *work, int wrenches) {
    if (wrenches) {
        EACH_LANE(l) {
            LANE_ROLLED
            for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
                work->acceleration[d] += wrench_along(tree, work, work->now.support.half[0], d);
            }
        }
        lanes_sync();
    }
    engine_solve(tree, work->factor[0], work->inverse, work->acceleration);
}

#endif
