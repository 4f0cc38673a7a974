/* M = L^T L, and what is solved with it. L is lower triangular and as sparse as M, because rows are
 * eliminated from the leaves to the root (Featherstone 2008, section 8.5: his L^T L factorisation;
 * with L^T D L the sums have one product more). Diagonal entries are kept inverted, apart. */
#ifndef MILD_ENGINE_FACTOR_H
#define MILD_ENGINE_FACTOR_H

#include "robot/engine/data.h"

/* Degrees of freedom of a lane: LANE, and LANE + LANES with more of them than lanes. */
#define DOF_SLOTS ((ENGINE_DOFS + LANES - 1) / LANES)
#define DOF_SLOT(d) (DOF_SLOTS == 1 ? 0 : (d) / LANES)

/* A bit for each degree of freedom: a GPU takes two instructions for a long one. */
#if ENGINE_DOFS <= 32
typedef unsigned EngineBits;
#else
typedef EnginePath EngineBits;
#endif

/* The rows of the hinges of a level, after those behind them; k are the degrees of freedom behind
 * d, i its ancestors:
 *
 *     L_dd^2 = M_dd - sum_k L_kd^2,   L_di = (M_di - sum_k L_kd L_ki)/L_dd
 *
 * A lane has an entry, and finds L_dd for itself. own: place of L_dd. */
WARP_FN void engine_factorise_level(const EngineTree *tree, int own, int begin, int end,
                                    const Real *matrix, Real *factor, Real *inverse) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int e = begin + LANE(l); e < end; e += LANES) {
            const EngineEntry entry = tree->entry[e];
            const int d = entry.dof;
            const int at = d * ENGINE_STRIDE + entry.place;
            const Real *left = factor + d * ENGINE_STRIDE + own;
            const Real *right = factor + at;
            Real diagonal = matrix[d * ENGINE_STRIDE + own];
            Real sum = matrix[at];
            LANE_ROLLED
            for (int k = entry.behind - d; k > 1; k--) {
                left += ENGINE_STRIDE;
                right += ENGINE_STRIDE;
                diagonal -= *left * *left;
                sum -= *left * *right;
            }
            const Real scale = REAL_INVERSE_SQRT(diagonal);
            if (entry.place == own) {
                inverse[d] = scale;
            } else {
                factor[at] = sum * scale;
            }
        }
    }
    lanes_sync();
}

/* The base's rows, after all hinges. A lane has an entry M_ij; the row k takes its part from those
 * above it: M_ij -= L_ki L_kj. */
WARP_FN void engine_factorise_base(const EngineTree *tree, const Real *matrix, Real *factor,
                                   Real *inverse) {
    Real x[LANE_COPIES];
    int row[LANE_COPIES], place[LANE_COPIES];
    EACH_LANE(l) {
        const EngineEntry entry = tree->entry[LANE(l) < ENGINE_BASE_ENTRIES ? LANE(l) : 0];
        const int i = row[l] = entry.dof;
        const int j = place[l] = entry.place;
        x[l] = LANE(l) < ENGINE_BASE_ENTRIES ? matrix[i * ENGINE_STRIDE + j] : 0;
        ENGINE_LOOP
        for (int k = 6; k < engine_dofs(tree); k++) {
            x[l] -= factor[k * ENGINE_STRIDE + i] * factor[k * ENGINE_STRIDE + j];
        }
        if (LANE(l) < ENGINE_BASE_ENTRIES) {
            factor[i * ENGINE_STRIDE + j] = x[l];
        }
    }
    lanes_sync();
    LANE_ROLLED
    for (int k = 5; k >= 0; k--) {
        const Real *from = factor + k * ENGINE_STRIDE; /* L_kk L_k */
        const Real scale = REAL_INVERSE_SQRT(from[k]);
        EACH_LANE(l) {
            if (LANE(l) < ENGINE_BASE_ENTRIES && row[l] < k) {
                x[l] -= from[row[l]] * scale * (from[place[l]] * scale);
                factor[row[l] * ENGINE_STRIDE + place[l]] = x[l];
            }
            if (LANE(l) == k) {
                inverse[k] = scale;
            }
        }
        lanes_sync();
    }
    EACH_LANE(l) {
        if (LANE(l) < ENGINE_BASE_ENTRIES) {
            factor[row[l] * ENGINE_STRIDE + place[l]] = x[l] * inverse[row[l]];
        }
    }
    lanes_sync();
}

/* factor and inverse <- L of a matrix with the sparsity of M, which may be `factor` itself. */
WARP_FN void engine_factorise(const EngineTree *tree, const Real *matrix, Real *factor,
                              Real *inverse) {
    int end = engine_entries(tree);
    LANE_ROLLED
    for (int level = tree->levels - 1; level > 0; level--) {
        const int begin = tree->level_entry[level];
        engine_factorise_level(tree, 5 + level, begin, end, matrix, factor, inverse);
        end = begin;
    }
    engine_factorise_base(tree, matrix, factor, inverse);
}

/* mass <- M = L^T L again: M_ij is the sum of L_ki L_kj over k, i and what is behind it. */
WARP_FN void engine_multiply_out(const EngineTree *tree, const Real *factor, const Real *inverse,
                                 Real *mass) {
    EACH_LANE(l) {
        LANE_ROLLED
        for (int e = LANE(l); e < engine_entries(tree); e += LANES) {
            const EngineEntry entry = tree->entry[e];
            const int d = entry.dof;
            const int own = tree->above[d];
            const Real *left = factor + d * ENGINE_STRIDE + own;
            const Real *right = factor + d * ENGINE_STRIDE + entry.place;
            const Real diagonal = 1 / inverse[d];
            Real sum = diagonal * (entry.place == own ? diagonal : *right);
            LANE_ROLLED
            for (int k = entry.behind - d; k > 1; k--) {
                left += ENGINE_STRIDE;
                right += ENGINE_STRIDE;
                sum += *left * *right;
            }
            mass[d * ENGINE_STRIDE + entry.place] = sum;
            if (d < 6) {
                mass[entry.place * ENGINE_STRIDE + d] = sum;
            }
        }
    }
    lanes_sync();
}

/* x <- L^-T x, leaves first. A lane has x of its degrees of freedom in registers. */
WARP_FN void engine_solve_transposed(const EngineTree *tree, const Real *factor,
                                     const Real *inverse, Real *x) {
    const int dofs = engine_dofs(tree);
    Real own[DOF_SLOTS][LANE_COPIES], scale[DOF_SLOTS][LANE_COPIES];
    unsigned behind[DOF_SLOTS][LANE_COPIES];   /* how many */
    unsigned after[DOF_SLOTS][LANE_COPIES];    /* of those before k, which wraps around below 0 */
    const Real *entry[DOF_SLOTS][LANE_COPIES]; /* of row k */
    EACH_LANE(l) {
        LANE_UNROLL
        for (int s = 0; s < DOF_SLOTS; s++) {
            const int d = LANE(l) + s * LANES;
            const int in = d < dofs;
            own[s][l] = in ? x[d] : 0;
            scale[s][l] = in ? inverse[d] : 0;
            behind[s][l] = in ? (unsigned)(tree->behind[d] - 1 - d) : 0;
            after[s][l] = (unsigned)(dofs - 2 - d);
            entry[s][l] = factor + (dofs - 1) * ENGINE_STRIDE + (in ? tree->above[d] : 0);
        }
    }
    LANE_ROLLED
    for (int k = dofs - 1; k > 0; k--) {
        Real scaled[LANE_COPIES];
        EACH_LANE(l) {
            scaled[l] = own[DOF_SLOT(k)][l] * scale[DOF_SLOT(k)][l];
        }
        const Real solved = lane_read(scaled, k % LANES);
        EACH_LANE(l) {
            LANE_UNROLL
            for (int s = 0; s < DOF_SLOTS; s++) {
                if (after[s][l] < behind[s][l]) {
                    own[s][l] -= *entry[s][l] * solved;
                }
                after[s][l]--;
                entry[s][l] -= ENGINE_STRIDE;
            }
        }
    }
    EACH_LANE(l) {
        LANE_UNROLL
        for (int s = 0; s < DOF_SLOTS; s++) {
            if (LANE(l) + s * LANES < dofs) {
                x[LANE(l) + s * LANES] = own[s][l] * scale[s][l];
            }
        }
    }
    lanes_sync();
}

/* x <- L^-1 x, root first: what a lane takes is the next entry of its row. */
WARP_FN void engine_solve(const EngineTree *tree, const Real *factor, const Real *inverse,
                          Real *x) {
    Real own[DOF_SLOTS][LANE_COPIES], scale[DOF_SLOTS][LANE_COPIES];
    EngineBits ancestors[DOF_SLOTS][LANE_COPIES];
    const Real *next[DOF_SLOTS][LANE_COPIES];
    EACH_LANE(l) {
        LANE_UNROLL
        for (int s = 0; s < DOF_SLOTS; s++) {
            const int d = LANE(l) + s * LANES;
            const int in = d < engine_dofs(tree);
            own[s][l] = in ? x[d] : 0;
            scale[s][l] = in ? inverse[d] : 0;
            ancestors[s][l] = in ? (EngineBits)tree->path[d] & ~((EngineBits)1 << d) : 0;
            next[s][l] = factor + d * ENGINE_STRIDE;
        }
    }
    LANE_ROLLED
    for (int k = 0; k < engine_dofs(tree) - 1; k++) {
        Real scaled[LANE_COPIES];
        EACH_LANE(l) {
            scaled[l] = own[DOF_SLOT(k)][l] * scale[DOF_SLOT(k)][l];
        }
        const Real solved = lane_read(scaled, k % LANES);
        EACH_LANE(l) {
            LANE_UNROLL
            for (int s = 0; s < DOF_SLOTS; s++) {
                const int takes = ancestors[s][l] >> k & 1;
                if (takes) {
                    own[s][l] -= *next[s][l] * solved;
                }
                next[s][l] += takes;
            }
        }
    }
    EACH_LANE(l) {
        LANE_UNROLL
        for (int s = 0; s < DOF_SLOTS; s++) {
            if (LANE(l) + s * LANES < engine_dofs(tree)) {
                x[LANE(l) + s * LANES] = own[s][l] * scale[s][l];
            }
        }
    }
    lanes_sync();
}

/* Row d of M x. */
MILD_HD Real mass_times(const EngineTree *tree, const Real *mass, const Real *x, int d) {
    const EngineIndex *dof = tree->row_dof[engine_dof_link(d)];
    const int above = tree->above[d];
    const int last = d < 6 ? 5 : above; /* the base's rows are whole */
    const Real *row = mass + d * ENGINE_STRIDE;
    Real sum = 0;
    LANE_ROLLED
    for (int place = 0; place <= last; place++) {
        sum += row[place] * x[dof[place]];
    }
    LANE_ROLLED
    for (int k = d < 6 ? 6 : d + 1; k < tree->behind[d]; k++) {
        sum += mass[k * ENGINE_STRIDE + above] * x[k];
    }
    return sum;
}

#endif
