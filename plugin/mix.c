#include "plugin/mix.h"

#include <math.h>
#include <string.h>

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
        memmove(mix->dx[1], mix->dx[0], sizeof mix->dx - sizeof mix->dx[0]);
        memmove(mix->dc[1], mix->dc[0], sizeof mix->dc - sizeof mix->dc[0]);
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
