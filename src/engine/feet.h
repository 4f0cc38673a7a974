/* The feet seen from the robot's degrees of freedom: poses, J, A = J M^-1 J^T and V_free, and back
 * from wrenches to accelerations. The wrench and twist of a foot refer to the origin of a flat
 * foot's body, the lowest point of a round foot. On soft ground a round foot transmits no moment,
 * so that the angular rows of A, V_free and its twist are 0, and its rotation is the identity. */
#ifndef MILD_ENGINE_FEET_H
#define MILD_ENGINE_FEET_H

#include "engine/factor.h"

/* Components of a foot's twist and wrench that soft ground has to do with. */
MILD_HD int foot_parts(const EngineTree *tree, int foot) {
    return tree->foot_round[foot] ? 3 : 6;
}

/* [m] Of a foot's reference point from the base's origin, world axes. */
MILD_HD void foot_point(const EngineModel *model, const EngineWork *work, int foot, Real *point) {
    const int link = model->tree.foot_link[foot];
    turn3(work->rotation[link], model->number.foot[foot].reference, point);
    for (int k = 0; k < 3; k++) {
        point[k] += work->position[link][k];
    }
    point[2] -= model->number.foot[foot].radius;
}

/* Twist of a foot per unit of the degree of freedom at a place of its row. */
MILD_HD void foot_column(const EngineModel *model, const EngineWork *work, int foot, int place,
                         Real *column) {
    const EngineTree *tree = &model->tree;
    const int j = place < 6 ? 0 : tree->ancestor[tree->foot_link[foot]][place - 5];
    Real axis[3];
    Real arm[3];
    foot_point(model, work, foot, arm);
    for (int k = 0; k < 3; k++) {
        axis[k] = place < 6 ? work->rotation[0][3 * k + (place < 3 ? place : place - 3)]
                            : work->axis[j][k];
        arm[k] -= work->position[j][k];
    }
    cross3(axis, arm, column);
    for (int k = 0; k < 3; k++) {
        column[k] = place < 3 ? (place == k) : column[k];
        column[3 + k] = place < 3 ? 0 : axis[k];
    }
}

/* Component c of the twist of a foot at the velocity x. */
MILD_HD Real foot_twist(const EngineTree *tree, const EngineSupport *support, const Real *x,
                        int foot, int c) {
    const int link = tree->foot_link[foot];
    const int length = engine_row_length(tree, link);
    Real sum = 0;
    LANE_ROLLED
    for (int place = 0; place < length; place++) {
        sum += support->jacobian[foot][place][c] * x[engine_row_dof(tree, link, place)];
    }
    return sum;
}

/* Poses and twists of the feet, and J. */
LANE_FN void engine_feet_pose(const EngineModel *model, EngineWork *work) {
    const EngineTree *tree = &model->tree;
    EngineSupport *support = &work->now.support;
    const int feet = engine_feet(tree);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int f = 0; f < feet; f++) {
            const int length = engine_row_length(tree, tree->foot_link[f]);
            LANE_ROLLED
            for (int place = LANE(l); place < length; place += LANES) {
                foot_column(model, work, f, place, support->jacobian[f][place]);
            }
        }
    }
    lanes_meet();
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < 6 * feet; n += LANES) {
            const int f = n / 6;
            const int c = n % 6;
            work->foot_velocity[f][c] =
                c < foot_parts(tree, f) ? foot_twist(tree, support, work->rate, f, c) : 0;
        }
        LANE_ROLLED
        for (int f = LANE(l); f < feet; f += LANES) {
            const Real *R = work->rotation[tree->foot_link[f]];
            const Real *turn = model->number.foot[f].turn;
            foot_point(model, work, f, work->foot_position[f]);
            for (int k = 0; k < 3; k++) {
                work->foot_position[f][k] += work->base[k];
            }
            for (int e = 0; e < 9; e++) {
                const Real column[3] = {turn[e % 3], turn[3 + e % 3], turn[6 + e % 3]};
                work->foot_rotation[f][e] =
                    tree->foot_round[f] ? (e % 4 == 0) : dot3(R + 3 * (e / 3), column);
            }
        }
    }
    lanes_meet();
}

/* In registers where the length of a chain is known to the compiler. */
#if ENGINE_FIXED
#define CHAIN_LOOP LANE_UNROLL
#else
#define CHAIN_LOOP LANE_ROLLED
#endif

/* L^-T J^T: a lane has a column of a foot, whose chain is a path, so it needs no other lane. As in
 * engine_solve_transposed, a solved entry is taken from those above it. */
LANE_FN void engine_half_solve(const EngineTree *tree, EngineWork *work) {
    EngineSupport *support = &work->now.support;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < 6 * engine_feet(tree); n += LANES) {
            const int f = n / 6;
            const int c = n % 6;
            const int link = tree->foot_link[f];
            const int length = engine_row_length(tree, link);
            const int part = c < foot_parts(tree, f);
            Real x[ENGINE_CHAIN];
            CHAIN_LOOP
            for (int place = 0; place < ENGINE_CHAIN; place++) {
                x[place] = part && place < length ? support->jacobian[f][place][c] : 0;
            }
            CHAIN_LOOP
            for (int k = ENGINE_CHAIN - 1; k >= 0; k--) {
                if (k < length) {
                    const Real *row = work->factor + tree->row[engine_row_dof(tree, link, k)];
                    x[k] *= row[k];
                    support->half[f][k][c] = x[k];
                    CHAIN_LOOP
                    for (int place = 0; place < k; place++) {
                        x[place] -= row[place] * x[k];
                    }
                }
            }
        }
    }
    lanes_meet();
}

/* A = J M^-1 J^T, of two feet over the degrees of freedom that move both. */
LANE_FN void engine_foot_inertia(const EngineTree *tree, EngineWork *work) {
    EngineSupport *support = &work->now.support;
    const int rows = 6 * engine_feet(tree);
    engine_half_solve(tree, work);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < rows * rows; n += LANES) {
            const int f = n / rows / 6;
            const int g = n % rows / 6;
            const int r = n / rows % 6;
            const int c = n % rows % 6;
            Real sum = 0;
            LANE_ROLLED
            for (int place = 0; place < tree->shared[f][g]; place++) {
                sum += support->half[f][place][r] * support->half[g][place][c];
            }
            support->ground.inverse_inertia[n] = sum;
        }
    }
    lanes_meet();
}

/* V_free = J (qvel + dt qacc). */
LANE_FN void engine_free_velocity(const EngineModel *model, EngineWork *work) {
    EngineSupport *support = &work->now.support;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = LANE(l); n < 6 * engine_feet(&model->tree); n += LANES) {
            const int f = n / 6;
            const int c = n % 6;
            Real gain = 0;
            if (c < foot_parts(&model->tree, f)) {
                gain =
                    model->number.dt * foot_twist(&model->tree, support, work->acceleration, f, c);
            }
            support->free_velocity[f][c] = work->foot_velocity[f][c] + gain;
        }
    }
    lanes_meet();
}

/* Degree of freedom d of the sum over the feet of rows^T wrench; rows [feet][chain][6]: J^T or
 * L^-T J^T. */
MILD_HD Real wrench_along(const EngineTree *tree, const EngineWork *work, const Real *rows, int d) {
    const int i = d < 6 ? 0 : d - 5;
    const int place = d < 6 ? d : engine_row_length(tree, i) - 1;
    Real sum = 0;
    LANE_ROLLED
    for (int f = 0; f < engine_feet(tree); f++) {
        if (tree->foot_link[f] < i || tree->foot_link[f] >= tree->end[i]) {
            continue; /* moves without the foot */
        }
        LANE_ROLLED
        for (int c = 0; c < foot_parts(tree, f); c++) {
            sum += rows[6 * (ENGINE_CHAIN * f + place) + c] * work->wrench[f][c];
        }
    }
    return sum;
}

/* Adds M^-1 J^T wrench to the acceleration, and J^T wrench to the force. Needs the rows of
 * engine_half_solve. */
LANE_FN void engine_add_wrench(const EngineTree *tree, EngineWork *work) {
    EngineSupport *support = &work->now.support;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            work->force[d] += wrench_along(tree, work, support->jacobian[0][0], d);
            support->change[d] = wrench_along(tree, work, support->half[0][0], d);
        }
    }
    lanes_meet();
    engine_solve(tree, work->factor, support->change);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int d = LANE(l); d < engine_dofs(tree); d += LANES) {
            work->acceleration[d] += support->change[d];
        }
    }
    lanes_meet();
}

#endif
