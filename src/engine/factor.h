/* M = L^T L, and what is solved with it. L is lower triangular and as sparse as M, because rows are
 * eliminated from the leaves to the root (Featherstone 2008, section 8.5: his L^T L factorisation;
 * with L^T D L the sums have one product more). Diagonal entries of L are stored inverted. */
#ifndef MILD_ENGINE_FACTOR_H
#define MILD_ENGINE_FACTOR_H

#include "engine/data.h"

/* Degrees of freedom of a lane: LANE, and LANE + LANES with more of them than lanes. */
#define DOF_SLOTS ((ENGINE_DOFS + LANES - 1) / LANES)
#define DOF_SLOT(d) (DOF_SLOTS == 1 ? 0 : (d) / LANES)

/* Row and column of the entry e of a packed lower triangle. */
MILD_HD void triangle_place(int e, int *row, int *column) {
    int r = (int)((REAL_SQRT(8 * REAL(e) + 1) - 1) / 2);
    r -= r * (r + 1) / 2 > e;
    r += (r + 1) * (r + 2) / 2 <= e;
    *row = r;
    *column = e - r * (r + 1) / 2;
}

/* factor: a symmetric matrix with the sparsity of M, replaced by L. Degree of freedom k takes its
 * row's part from the rows of its ancestors, last one first:
 *
 *     L_kk = sqrt(M_kk),   L_ki = M_ki/L_kk,   M_ij -= L_ki L_kj   for the ancestors i, j of k */
LANE_CALL void engine_factorise(const EngineTree *tree, Real *factor) {
    LANE_ROLLED
    for (int k = engine_dofs(tree) - 1; k >= 0; k--) {
        const int link = k < 6 ? 0 : k - 5;
        const int above = k < 6 ? k : engine_row_length(tree, link) - 1;
        Real *row = factor + tree->row[k];
        const Real inverse = REAL_INVERSE_SQRT(row[above]);
        lanes_meet();
        EACH_LANE(l) {
            LANE_ROLLED
            for (int place = LANE(l); place <= above; place += LANES) {
                row[place] = place < above ? row[place] * inverse : inverse;
            }
        }
        lanes_meet();
        EACH_LANE(l) {
            LANE_ROLLED
            for (int e = LANE(l); e < above * (above + 1) / 2; e += LANES) {
                int i, j;
                triangle_place(e, &i, &j);
                factor[tree->row[engine_row_dof(tree, link, i)] + j] -= row[i] * row[j];
            }
        }
        lanes_meet();
    }
}

/* x <- L^-T x, leaves first. A lane has x of its degrees of freedom in registers. */
LANE_CALL void engine_solve_transposed(const EngineTree *tree, const Real *factor, Real *x) {
    Real own[DOF_SLOTS][LANE_COPIES], inverse[DOF_SLOTS][LANE_COPIES];
    EACH_LANE(l) {
        LANE_UNROLL
        for (int s = 0; s < DOF_SLOTS; s++) {
            const int d = LANE(l) + s * LANES;
            const int in = d < engine_dofs(tree);
            own[s][l] = in ? x[d] : 0;
            inverse[s][l] = in ? factor[tree->row[d] + engine_dofs_above(tree, d)] : 0;
        }
    }
    LANE_ROLLED
    for (int k = engine_dofs(tree) - 1; k >= 0; k--) {
        Real scaled[LANE_COPIES];
        const Real *row = factor + tree->row[k];
        const EnginePath path = tree->path[k];
        EACH_LANE(l) {
            scaled[l] = own[DOF_SLOT(k)][l] * inverse[DOF_SLOT(k)][l];
        }
        const Real solved = lane_read(scaled, k % LANES);
        EACH_LANE(l) {
            LANE_UNROLL
            for (int s = 0; s < DOF_SLOTS; s++) {
                const int d = LANE(l) + s * LANES;
                if (path >> d & 1) {
                    own[s][l] =
                        d == k ? solved : own[s][l] - row[engine_dofs_above(tree, d)] * solved;
                }
            }
        }
    }
    EACH_LANE(l) {
        LANE_UNROLL
        for (int s = 0; s < DOF_SLOTS; s++) {
            if (LANE(l) + s * LANES < engine_dofs(tree)) {
                x[LANE(l) + s * LANES] = own[s][l];
            }
        }
    }
    lanes_meet();
}

/* x <- L^-1 x, root first. */
LANE_CALL void engine_solve(const EngineTree *tree, const Real *factor, Real *x) {
    Real own[DOF_SLOTS][LANE_COPIES], inverse[DOF_SLOTS][LANE_COPIES];
    EACH_LANE(l) {
        LANE_UNROLL
        for (int s = 0; s < DOF_SLOTS; s++) {
            const int d = LANE(l) + s * LANES;
            const int in = d < engine_dofs(tree);
            own[s][l] = in ? x[d] : 0;
            inverse[s][l] = in ? factor[tree->row[d] + engine_dofs_above(tree, d)] : 0;
        }
    }
    LANE_ROLLED
    for (int k = 0; k < engine_dofs(tree); k++) {
        Real scaled[LANE_COPIES];
        const int above = engine_dofs_above(tree, k);
        EACH_LANE(l) {
            scaled[l] = own[DOF_SLOT(k)][l] * inverse[DOF_SLOT(k)][l];
        }
        const Real solved = lane_read(scaled, k % LANES);
        EACH_LANE(l) {
            LANE_UNROLL
            for (int s = 0; s < DOF_SLOTS; s++) {
                const int d = LANE(l) + s * LANES;
                if (d < engine_dofs(tree) && (tree->path[d] >> k & 1)) {
                    own[s][l] = d == k ? solved : own[s][l] - factor[tree->row[d] + above] * solved;
                }
            }
        }
    }
    EACH_LANE(l) {
        LANE_UNROLL
        for (int s = 0; s < DOF_SLOTS; s++) {
            if (LANE(l) + s * LANES < engine_dofs(tree)) {
                x[LANE(l) + s * LANES] = own[s][l];
            }
        }
    }
    lanes_meet();
}

/* x of degree of freedom d, at `place` in the rows behind its link i, less what those take. */
MILD_HD Real gathered(const EngineTree *tree, const Real *factor, const Real *x, int i, int place) {
    Real sum = 0;
    LANE_ROLLED
    for (int k = i + 1; k < tree->end[i]; k++) {
        sum += factor[tree->row[5 + k] + place] * x[5 + k];
    }
    return sum;
}

/* Row d of M x. */
MILD_HD Real mass_times(const EngineTree *tree, const Real *mass, const Real *x, int d) {
    const int i = d < 6 ? 0 : d - 5;
    const int last = d < 6 ? d : engine_row_length(tree, i) - 1;
    const Real *row = mass + tree->row[d];
    Real sum = gathered(tree, mass, x, i, last);
    LANE_ROLLED
    for (int place = 0; place <= last; place++) {
        sum += row[place] * x[d < 6 ? place : engine_row_dof(tree, i, place)];
    }
    for (int k = d + 1; k < 6; k++) {
        sum += mass[k * (k + 1) / 2 + d] * x[k];
    }
    return sum;
}

#endif
