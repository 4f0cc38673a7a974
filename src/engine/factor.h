/* M = L^T L, and what is solved with it. L is lower triangular and as sparse as M, because rows are
 * eliminated from the leaves to the root (Featherstone 2008, section 8.5: his L^T L factorisation;
 * with L^T D L the sums have one product more). Diagonal entries of L are stored inverted. */
#ifndef MILD_ENGINE_FACTOR_H
#define MILD_ENGINE_FACTOR_H

#include "engine/data.h"

/* Sum over the links that hang on link i (all for the base) of the products of two places of their
 * rows. */
MILD_HD Real row_products(const EngineTree *tree, const Real *factor, int i, int first,
                          int second) {
    Real sum = 0;
    for (int k = i + 1; k < tree->end[i]; k++) {
        const Real *row = factor + tree->row[5 + k];
        sum += row[first] * row[second];
    }
    return sum;
}

/* The base's six rows, dense; few and one behind the other, so they are the work of one lane. */
MILD_HD void factor_base(Real *factor) {
    Real m[6][6];
    LANE_UNROLL
    for (int r = 0; r < 6; r++) {
        LANE_UNROLL
        for (int c = 0; c <= r; c++) {
            m[r][c] = factor[r * (r + 1) / 2 + c];
        }
    }
    LANE_UNROLL
    for (int k = 5; k >= 0; k--) {
        const Real inverse = REAL_INVERSE_SQRT(m[k][k]);
        LANE_UNROLL
        for (int c = 0; c < k; c++) {
            m[k][c] *= inverse;
        }
        LANE_UNROLL
        for (int r = 0; r < k; r++) {
            LANE_UNROLL
            for (int c = 0; c <= r; c++) {
                m[r][c] -= m[k][r] * m[k][c];
            }
        }
        m[k][k] = inverse;
    }
    LANE_UNROLL
    for (int r = 0; r < 6; r++) {
        LANE_UNROLL
        for (int c = 0; c <= r; c++) {
            factor[r * (r + 1) / 2 + c] = m[r][c];
        }
    }
}

/* factor: a symmetric matrix with the sparsity of M, replaced by L. A lane owns an entry and
 * gathers from the rows behind it, which are ready: no two lanes write to one entry, and the sums
 * do not wait for each other. */
LANE_FN void engine_factorise(const EngineTree *tree, Real *factor) {
    for (int level = tree->levels - 1; level > 0; level--) {
        const int begin = tree->level_entry[level];
        const int end = tree->level_entry[level + 1];
        EACH_LANE(l) {
            for (int e = begin + LANE(l); e < end; e += LANES) {
                const int i = tree->entry_dof[e] - 5;
                factor[e] -= row_products(tree, factor, i, engine_row_length(tree, i) - 1,
                                          tree->entry_place[e]);
            }
        }
        lanes_meet();
        EACH_LANE(l) {
            for (int n = tree->level_begin[level] + LANE(l); n < tree->level_begin[level + 1];
                 n += LANES) {
                const int i = tree->level_link[n];
                Real *diagonal = factor + tree->row[5 + i] + engine_row_length(tree, i) - 1;
                *diagonal = REAL_INVERSE_SQRT(*diagonal);
            }
        }
        lanes_meet();
        EACH_LANE(l) {
            for (int e = begin + LANE(l); e < end; e += LANES) {
                const int i = tree->entry_dof[e] - 5;
                const int last = engine_row_length(tree, i) - 1;
                if (tree->entry_place[e] < last) {
                    factor[e] *= factor[tree->row[5 + i] + last];
                }
            }
        }
        lanes_meet();
    }
    EACH_LANE(l) {
        for (int e = LANE(l); e < ENGINE_BASE_ENTRIES; e += LANES) {
            factor[e] -= row_products(tree, factor, 0, tree->entry_dof[e], tree->entry_place[e]);
        }
    }
    lanes_meet();
    EACH_LANE(l) {
        if (LANE(l) == 0) {
            factor_base(factor);
        }
    }
    lanes_meet();
}

/* x of degree of freedom d, at `place` in the rows behind its link i, less what those take. */
MILD_HD Real gathered(const EngineTree *tree, const Real *factor, const Real *x, int i, int place) {
    Real sum = 0;
    for (int k = i + 1; k < tree->end[i]; k++) {
        sum += factor[tree->row[5 + k] + place] * x[5 + k];
    }
    return sum;
}

/* x <- L^-T x: leaves first. */
LANE_FN void engine_solve_transposed(const EngineTree *tree, const Real *factor, Real *x) {
    for (int level = tree->levels - 1; level > 0; level--) {
        EACH_LANE(l) {
            for (int n = tree->level_begin[level] + LANE(l); n < tree->level_begin[level + 1];
                 n += LANES) {
                const int i = tree->level_link[n];
                const int place = engine_row_length(tree, i) - 1;
                x[5 + i] = (x[5 + i] - gathered(tree, factor, x, i, place)) *
                           factor[tree->row[5 + i] + place];
            }
        }
        lanes_meet();
    }
    EACH_LANE(l) {
        for (int d = LANE(l); d < 6; d += LANES) {
            x[d] -= gathered(tree, factor, x, 0, d);
        }
    }
    lanes_meet();
    EACH_LANE(l) {
        for (int d = LANE(l) == 0 ? 5 : -1; d >= 0; d--) {
            for (int k = d + 1; k < 6; k++) {
                x[d] -= factor[k * (k + 1) / 2 + d] * x[k];
            }
            x[d] *= factor[d * (d + 1) / 2 + d];
        }
    }
    lanes_meet();
}

/* x <- L^-1 x: root first. */
LANE_FN void engine_solve(const EngineTree *tree, const Real *factor, Real *x) {
    EACH_LANE(l) {
        for (int d = LANE(l); d < 6 && LANE(l) == 0; d++) {
            for (int k = 0; k < d; k++) {
                x[d] -= factor[d * (d + 1) / 2 + k] * x[k];
            }
            x[d] *= factor[d * (d + 1) / 2 + d];
        }
    }
    lanes_meet();
    for (int level = 1; level < tree->levels; level++) {
        EACH_LANE(l) {
            for (int n = tree->level_begin[level] + LANE(l); n < tree->level_begin[level + 1];
                 n += LANES) {
                const int i = tree->level_link[n];
                const Real *row = factor + tree->row[5 + i];
                const int last = engine_row_length(tree, i) - 1;
                Real sum = x[5 + i];
                for (int place = 0; place < last; place++) {
                    sum -= row[place] * x[engine_row_dof(tree, i, place)];
                }
                x[5 + i] = sum * row[last];
            }
        }
        lanes_meet();
    }
}

/* Row d of M x. */
MILD_HD Real mass_times(const EngineTree *tree, const Real *mass, const Real *x, int d) {
    const int i = d < 6 ? 0 : d - 5;
    const int last = d < 6 ? d : engine_row_length(tree, i) - 1;
    const Real *row = mass + tree->row[d];
    Real sum = gathered(tree, mass, x, i, last);
    for (int place = 0; place <= last; place++) {
        sum += row[place] * x[d < 6 ? place : engine_row_dof(tree, i, place)];
    }
    for (int k = d + 1; k < 6; k++) {
        sum += mass[k * (k + 1) / 2 + d] * x[k];
    }
    return sum;
}

#endif
