/* Newton's equations of bodies_newton.h, [1 + H A | right side] of the active rows, and their
 * solution by a team: of at most 32 rows in registers, of more in shared memory. */
#ifndef MILD_BATCH_BODIES_EQUATIONS_H
#define MILD_BATCH_BODIES_EQUATIONS_H

/* What the six columns of a body do to the others. */
typedef struct {
    int chosen[6];     /* [column] row of the body that its row changes places with */
    Real inverse[6];   /* [column] of the pivot */
    Real pivot[6][6];  /* [column][from that column on] the pivot's row */
    Real factor[6][6]; /* [row of the body][column] */
} BodiesPanel;

/* The row to take as the pivot of column k: k, unless a number below it in the rows of its body is
 * far larger. From body to body 1 + H A stays away from singular, but not from row to row: where
 * a body's forces turn its origin against them the diagonal passes through 0. */
MILD_HD int bodies_pivot(const Real block[6][6], int k) {
    Real most = BODIES_GROWTH * REAL_ABS(block[k][k]);
    int larger = 0;
    int chosen = k;
    LANE_UNROLL
    for (int r = k + 1; r < 6; r++) { /* of no row as a rule, which is soon seen */
        larger |= REAL_ABS(block[r][k]) > most;
    }
    if (larger) {
        LANE_UNROLL
        for (int r = k + 1; r < 6; r++) {
            const Real size = REAL_ABS(block[r][k]);
            chosen = size > most ? r : chosen;
            most = real_max(size, most);
        }
    }
    return chosen;
}

/* Numbers k and `chosen` of six change places. The index is a constant in each round, so that x
 * may be in registers. */
MILD_HD void bodies_exchange(Real *x, int next, int k, int chosen) {
    const Real kept = x[k * next];
    LANE_UNROLL
    for (int r = 0; r < 6; r++) {
        if (r > k && r == chosen) {
            x[k * next] = x[r * next];
            x[r * next] = kept;
        }
    }
}

/* The rows of a body, from `first` on, in the columns of its own. All lanes compute it. */
MILD_HD void bodies_panel(const Real *matrix, int stride, int first, BodiesPanel *panel) {
    Real block[6][6];
    LANE_UNROLL
    for (int r = 0; r < 6; r++) {
        LANE_UNROLL
        for (int c = 0; c < 6; c++) {
            block[r][c] = matrix[(first + r) * stride + first + c];
        }
    }
    LANE_UNROLL
    for (int k = 0; k < 6; k++) {
        const int chosen = bodies_pivot(block, k);
        if (chosen != k) {
            LANE_UNROLL
            for (int c = k; c < 6; c++) {
                bodies_exchange(&block[0][c], 6, k, chosen);
            }
        }
        panel->chosen[k] = chosen;
        panel->inverse[k] = 1 / block[k][k];
        LANE_UNROLL
        for (int c = k; c < 6; c++) {
            panel->pivot[k][c] = block[k][c];
        }
        LANE_UNROLL
        for (int r = 0; r < 6; r++) {
            panel->factor[r][k] = r == k ? 0 : block[r][k] * panel->inverse[k];
            LANE_UNROLL
            for (int c = k + 1; c < 6; c++) {
                block[r][c] =
                    r == k ? block[r][c] : block[r][c] - panel->factor[r][k] * panel->pivot[k][c];
            }
        }
    }
}

/* The factors of row r, which is another body's, in place of its numbers in the panel's columns. */
MILD_HD void bodies_factors(const BodiesPanel *panel, Real *row) {
    Real x[6];
    LANE_UNROLL
    for (int k = 0; k < 6; k++) {
        x[k] = row[k];
    }
    LANE_UNROLL
    for (int k = 0; k < 6; k++) {
        const Real factor = x[k] * panel->inverse[k];
        row[k] = factor;
        LANE_UNROLL
        for (int c = k + 1; c < 6; c++) {
            x[c] -= factor * panel->pivot[k][c];
        }
    }
}

/* One column in the rows of the panel, x, as the panel's columns leave it. pivot: [column] its
 * number in the row of each pivot. */
MILD_HD void bodies_panel_column(const BodiesPanel *panel, Real *x, Real *pivot) {
    LANE_UNROLL
    for (int k = 0; k < 6; k++) {
        if (panel->chosen[k] != k) {
            bodies_exchange(x, 1, k, panel->chosen[k]);
        }
        pivot[k] = x[k];
        LANE_UNROLL
        for (int r = 0; r < 6; r++) {
            x[r] = r == k ? x[r] : x[r] - panel->factor[r][k] * pivot[k];
        }
    }
}

/* The columns behind the panel, and the pivots on the diagonal. */
TEAM_FN void bodies_columns(Real *matrix, int rows, int first, const BodiesPanel *panel) {
    const int stride = rows + 1;
    LANE_ROLLED
    for (int from = first + 6 + TEAM_WARP; from < stride; from += BODIES_COLUMNS * TEAM_WARPS) {
        Real x[6][LANE_COPIES], pivot[6][LANE_COPIES];
        EACH_LANE(l) {
            const int j = from + LANE(l) % BODIES_COLUMNS * TEAM_WARPS;
            Real own[6], of[6];
            LANE_UNROLL
            for (int r = 0; r < 6; r++) {
                own[r] = j < stride ? matrix[(first + r) * stride + j] : 0;
            }
            bodies_panel_column(panel, own, of);
            LANE_UNROLL
            for (int r = 0; r < 6; r++) {
                x[r][l] = own[r];
                pivot[r][l] = of[r];
            }
        }
        lanes_sync(); /* all have read what is written below */
        EACH_LANE(l) {
            const int j = from + LANE(l) % BODIES_COLUMNS * TEAM_WARPS;
            LANE_ROLLED
            for (int r = LANE(l) / BODIES_COLUMNS; r < rows && j < stride;
                 r += LANES / BODIES_COLUMNS) {
                if (r < first || r >= first + 6) {
                    const Real *factor = matrix + r * stride + first;
                    Real entry = matrix[r * stride + j];
                    LANE_UNROLL
                    for (int k = 0; k < 6; k++) {
                        entry -= factor[k] * pivot[k][l];
                    }
                    matrix[r * stride + j] = entry;
                }
            }
            LANE_UNROLL
            for (int r = 0; r < 6; r++) {
                if (j < stride && LANE(l) / BODIES_COLUMNS == r % (LANES / BODIES_COLUMNS)) {
                    matrix[(first + r) * stride + j] = x[r][l];
                }
            }
        }
    }
    EACH_LANE(l) {
        LANE_UNROLL
        for (int k = 0; k < 6; k++) {
            if (TEAM_LANE(l) == k) {
                matrix[(first + k) * stride + first + k] = panel->pivot[k][k];
            }
        }
    }
}

/* The lane whose row is the pivot of column k. place: [lane] of its row among the pivots, which may
 * change. As bodies_pivot, without moving rows. column: [lane] the number there. */
WARP_FN int bodies_pivot_lane(int k, const Real *column, int *place) {
    const int end = k - k % 6 + 6;
    int flag[LANE_COPIES];
    EACH_LANE(l) {
        flag[l] = place[l] == k;
    }
    const int first = lanes_first(flag);
    const Real least = BODIES_GROWTH * REAL_ABS(lane_read(column, first));
    EACH_LANE(l) {
        flag[l] = place[l] > k && place[l] < end && REAL_ABS(column[l]) > least;
    }
    if (lanes_first(flag) == LANES) { /* as a rule */
        return first;
    }
    Real size[LANE_COPIES];
    EACH_LANE(l) {
        size[l] = flag[l] ? REAL_ABS(column[l]) : 0;
    }
    const Real most = lane_max(size);
    EACH_LANE(l) {
        flag[l] = flag[l] && REAL_ABS(column[l]) >= most;
    }
    const int chosen = lanes_first(flag);
    Real was[LANE_COPIES];
    EACH_LANE(l) {
        was[l] = (Real)place[l];
    }
    const int free = (int)lane_read(was, chosen);
    EACH_LANE(l) { /* the two change places */
        place[l] = LANE(l) == chosen ? k : LANE(l) == first ? free : place[l];
    }
    return chosen;
}

/* Gauss and Jordan; the last column becomes the solution. Six columns at a time, those of a body:
 * first all lanes have the pivots and each the factors of a row, then a warp has its share of the
 * columns behind, eight at a time, in four groups of rows. So the team waits twice for six columns.
 *
 * A factor is rounded once for its whole row, which is then still a row of the same equations: with
 * the pivot's row divided in its place the error of each number grows with that row over its pivot,
 * and Newton's method ends at half of the residual on a Go1 that comes down in loose sand. */
TEAM_FN void bodies_eliminate(BodiesWork *work, int rows) {
    const int stride = rows + 1;
    Real *matrix = work->matrix;
    LANE_ROLLED
    for (int first = 0; first < rows; first += 6) {
        BodiesPanel panel;
        bodies_panel(matrix, stride, first, &panel);
        EACH_LANE(l) {
            LANE_ROLLED
            for (int r = TEAM_LANE(l); r < rows; r += TEAM) {
                if (r < first || r >= first + 6) {
                    bodies_factors(&panel, matrix + r * stride + first);
                }
            }
        }
        team_sync();
        bodies_columns(matrix, rows, first, &panel);
        team_sync();
    }
    EACH_LANE(l) {
        LANE_ROLLED
        for (int r = TEAM_LANE(l); r < rows; r += TEAM) {
            matrix[r * stride + rows] /= matrix[r * stride + r];
        }
    }
    team_sync();
}

/* Number m of the row of the active row n in [1 + H A | right side], where H is that row's of its
 * body's hessian. corrects: bool, as in contact_newton.inc. */
MILD_HD Real bodies_entry(const BodiesWork *work, int rows, const BodiesPoint *at, int corrects,
                          int n, int m, const Real *H) {
    const int r = work->active_row[n];
    const int first = r - r % 6;
    const int right = m == work->active; /* the right side */
    const int j = work->active_row[right ? 0 : m];
    const Real *A = work->inverse_inertia + first * rows;
    Real sum = right ? at->wrench[r] - at->impulse[r] : r == j ? 1 : 0;
    LANE_UNROLL
    for (int k = 0; k < 6 && !(right && corrects); k++) {
        sum += H[k] *
               (right ? at->twist[first + k] - work->free_velocity[first + k] : A[k * rows + j]);
    }
    return sum;
}

MILD_HD const Real *bodies_hessian_row(const BodiesWork *work, int n) {
    const int r = work->active_row[n];
    return work->hessian[r / 6] + 6 * (r % 6);
}

/* Solves Newton's equations of any number of rows, in shared memory. The solution is left in
 * work->row[0]. */
TEAM_FN void bodies_solve_shared(BodiesWork *work, int rows, const BodiesPoint *at, int corrects) {
    const int active = work->active;
    const int stride = active + 1;
    LANE_ROLLED
    for (int n = TEAM_WARP; n < active; n += TEAM_WARPS) {
        EACH_LANE(l) {
            LANE_ROLLED
            for (int m = LANE(l); m < stride; m += LANES) {
                work->matrix[n * stride + m] =
                    bodies_entry(work, rows, at, corrects, n, m, bodies_hessian_row(work, n));
            }
        }
    }
    team_sync();
    bodies_eliminate(work, active);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int n = TEAM_LANE(l); n < active; n += TEAM) {
            work->row[0][work->active_row[n]] = work->matrix[n * stride + active];
        }
    }
    team_sync();
}

#ifndef BODIES_REGISTER_ROWS
#define BODIES_REGISTER_ROWS LANES /* rows at most of those; an includer may have its own */
#endif
/* Columns of a warp in bodies_solve_rows: column m is number m / TEAM_WARPS of warp m % TEAM_WARPS.
 * On the CPU one warp has all. An includer may have its own number for a GPU. */
#ifndef BODIES_WARP_COLUMNS
#define BODIES_WARP_COLUMNS 9
#endif
#define BODIES_OWN_COLUMNS (LANE_COPIES == 1 ? BODIES_WARP_COLUMNS : LANES + 1)

/* Column `number` of a warp's, whose index is a constant in each round, so that M may be in
 * registers. */
MILD_HD Real bodies_own_column(Real M[BODIES_OWN_COLUMNS][LANE_COPIES], int number, int l) {
    Real value = M[0][l];
    LANE_UNROLL
    for (int c = 1; c < BODIES_OWN_COLUMNS; c++) {
        value = c == number ? M[c][l] : value;
    }
    return value;
}

/* The rows of bodies_solve_rows; shows the first column. */
TEAM_FN void bodies_load_rows(BodiesWork *work, int rows, const BodiesPoint *at, int corrects,
                              Real M[BODIES_OWN_COLUMNS][LANE_COPIES]) {
    const int active = work->active;
    EACH_LANE(l) {
        const int is_row = LANE(l) < active;
        const int n = is_row ? LANE(l) : 0;
        Real H[6];
        LANE_UNROLL
        for (int k = 0; k < 6; k++) {
            H[k] = is_row ? bodies_hessian_row(work, n)[k] : 0;
        }
        LANE_UNROLL
        for (int c = 0; c < BODIES_OWN_COLUMNS; c++) {
            const int m = TEAM_WARP + c * TEAM_WARPS;
            M[c][l] = m <= active ? bodies_entry(work, rows, at, corrects, n, m, H) : 0;
        }
        if (TEAM_WARP == 0 && is_row) {
            work->row[0][n] = M[0][l];
        }
    }
    team_sync();
}

/* The same of at most BODIES_REGISTER_ROWS rows and BODIES_OWN_COLUMNS TEAM_WARPS columns: a lane
 * has a row, of which its warp has some columns in registers. Gauss and Jordan: the warp that has
 * column k shows it to the team, all choose the pivot, and each warp subtracts its row from its own
 * columns. */
TEAM_FN void bodies_solve_rows(BodiesWork *work, int rows, const BodiesPoint *at, int corrects) {
    const int active = work->active;
    Real M[BODIES_OWN_COLUMNS][LANE_COPIES], own[LANE_COPIES], column[LANE_COPIES] = {0};
    int place[LANE_COPIES];
    bodies_load_rows(work, rows, at, corrects, M);
    EACH_LANE(l) {
        place[l] = LANE(l);
        own[l] = 0;
    }
    LANE_ROLLED
    for (int k = 0, owner = 0, number = 0; k < active; k++) {
        Real factor[LANE_COPIES];
        EACH_LANE(l) {
            column[l] = LANE(l) < active ? work->row[k % 2][LANE(l)] : 0;
        }
        const int pivot = bodies_pivot_lane(k, column, place);
        const Real inverse = 1 / lane_read(column, pivot);
        EACH_LANE(l) {
            const int is_pivot = LANE(l) == pivot;
            own[l] = is_pivot ? inverse : own[l];
            factor[l] = is_pivot ? 0 : column[l] * inverse;
        }
        LANE_UNROLL
        for (int c = 0; c < BODIES_OWN_COLUMNS; c++) {
            if (TEAM_WARP + c * TEAM_WARPS > k && TEAM_WARP + c * TEAM_WARPS <= active) {
                const Real entry = lane_read(M[c], pivot);
                EACH_LANE(l) {
                    M[c][l] -= factor[l] * entry;
                }
            }
        }
        owner = owner + 1 < TEAM_WARPS ? owner + 1 : 0; /* of the next column */
        number += owner == 0;
        EACH_LANE(l) {
            if (TEAM_WARP == owner && LANE(l) < active) {
                const Real next = bodies_own_column(M, number, l);
                if (k + 1 < active) {
                    work->row[(k + 1) % 2][LANE(l)] = next;
                } else { /* the right side */
                    column[l] = next;
                }
            }
        }
        team_sync();
    }
    EACH_LANE(l) {
        if (active % TEAM_WARPS == TEAM_WARP && LANE(l) < active) {
            work->row[0][work->active_row[place[l]]] = column[l] * own[l];
        }
    }
    team_sync();
}

#endif
