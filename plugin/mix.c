#include "plugin/soft.h"

#include <math.h>
#include <string.h>

#include <mujoco/mujoco.h>

#define RIDGE 1e-12 /* [-] relative, keeps the normal equations solvable */

void mix_start(Mix *mix, int rows) {
    mix->rows = rows;
    mix->known = mix->steps = 0;
}

static double dot(const double *a, const double *b, int rows) {
    double sum = 0;
    for (int r = 0; r < rows; r++) {
        sum += a[r] * b[r];
    }
    return sum;
}

/* Remembers the differences to the last call; the oldest step goes. */
static void remember(Mix *mix, const double *x, const double *c) {
    const size_t bytes = (size_t)mix->rows * sizeof *x;
    if (mix->known) {
        for (int j = MIX_DEPTH - 1; j > 0; j--) {
            memcpy(mix->dx[j], mix->dx[j - 1], bytes);
            memcpy(mix->dc[j], mix->dc[j - 1], bytes);
        }
        for (int r = 0; r < mix->rows; r++) {
            mix->dx[0][r] = x[r] - mix->x[r];
            mix->dc[0][r] = c[r] - mix->c[r];
        }
        mix->steps += mix->steps < MIX_DEPTH;
    }
    memcpy(mix->x, x, bytes);
    memcpy(mix->c, c, bytes);
    mix->known = 1;
}

/* share = argmin |c - sum share_j dc_j|^2, by Gauss elimination of the normal equations. */
static void best_shares(const Mix *mix, const double *c, double *share) {
    const int n = mix->steps;
    double a[MIX_DEPTH][MIX_DEPTH] = {{0}};
    for (int i = 0; i < n; i++) {
        share[i] = dot(mix->dc[i], c, mix->rows);
        for (int j = 0; j < n; j++) {
            a[i][j] = dot(mix->dc[i], mix->dc[j], mix->rows);
        }
        a[i][i] *= 1 + RIDGE;
        a[i][i] += 1e-300;
    }
    for (int p = 0; p < n; p++) {
        for (int i = p + 1; i < n; i++) {
            const double factor = a[i][p] / a[p][p];
            for (int j = p; j < n; j++) {
                a[i][j] -= factor * a[p][j];
            }
            share[i] -= factor * share[p];
        }
    }
    for (int p = n - 1; p >= 0; p--) {
        for (int j = p + 1; j < n; j++) {
            share[p] -= a[p][j] * share[j];
        }
        share[p] /= a[p][p];
    }
}

void mix_next(Mix *mix, double *x, const double *c) {
    double share[MIX_DEPTH] = {0};
    int finite = 1;
    remember(mix, x, c);
    best_shares(mix, c, share);
    for (int j = 0; j < mix->steps; j++) {
        finite &= isfinite(share[j]) != 0;
    }
    for (int r = 0; r < mix->rows; r++) {
        x[r] += c[r];
        for (int j = 0; j < mix->steps && finite; j++) {
            x[r] -= share[j] * (mix->dx[j][r] + mix->dc[j][r]);
        }
    }
}

/* matrix = 1 + A H; [rows][rows] */
static void one_plus_product(const double *A, const double *H, int rows, double *matrix) {
    mju_mulMatMat(matrix, A, H, rows, rows, rows);
    for (int r = 0; r < rows; r++) {
        matrix[r * rows + r] += 1;
    }
}

/* u = matrix^-1 u by Gauss elimination with exchange of rows; the matrix is lost. */
static int eliminate(double *matrix, double *u, int n) {
    for (int p = 0; p < n; p++) {
        int best = p;
        for (int i = p + 1; i < n; i++) {
            best = fabs(matrix[i * n + p]) > fabs(matrix[best * n + p]) ? i : best;
        }
        if (!(fabs(matrix[best * n + p]) > 0)) {
            return 0;
        }
        for (int j = p; j < n && best != p; j++) {
            const double other = matrix[p * n + j];
            matrix[p * n + j] = matrix[best * n + j];
            matrix[best * n + j] = other;
        }
        const double other = u[p];
        u[p] = u[best];
        u[best] = other;
        for (int i = p + 1; i < n; i++) {
            const double factor = matrix[i * n + p] / matrix[p * n + p];
            mju_addToScl(matrix + i * n + p, matrix + p * n + p, -factor, n - p);
            u[i] -= factor * u[p];
        }
    }
    for (int p = n - 1; p >= 0; p--) {
        u[p] -= mju_dot(matrix + p * n + p + 1, u + p + 1, n - 1 - p);
        u[p] /= matrix[p * n + p];
    }
    return 1;
}

int mix_newton(const Mix *mix, const double *A, const double *E, const double *H, const double *c,
               double *x) {
    const int n = mix->rows;
    double matrix[MIX_ROWS * MIX_ROWS], u[MIX_ROWS], moved[MIX_ROWS];
    memcpy(u, c, (size_t)n * sizeof *u);
    one_plus_product(E, H, n, matrix);
    if (!eliminate(matrix, u, n)) {
        return 0;
    }
    one_plus_product(A, H, n, matrix);
    mju_mulMatVec(moved, matrix, u, n, n);
    for (int r = 0; r < n; r++) {
        if (!isfinite(moved[r])) {
            return 0;
        }
    }
    mju_addTo(x, moved, n);
    return 1;
}
