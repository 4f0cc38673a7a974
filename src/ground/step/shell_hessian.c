#include "ground/step/shell_hessian.h"

#include <string.h>

#include "ground/step/moments.h"

/* Moments of the entries of h, by 1, x, y, z, x^2, xy, y^2, yz, z^2, zx. */
typedef double ShellMoments[3][3][10];

/* Three times the loop for x and y, over (x, y), (y, z) and (z, x): a loop of its own would be
 * faster and larger. */
static void shell_moments(const FootScratch *foot, ShellMoments M) {
    static const int place[3][6] = {{0, 1, 2, 4, 5, 6}, {0, 2, 3, 6, 7, 8}, {0, 3, 1, 8, 9, 4}};
    const Slots *s = foot->slot;
    const Real *const at[3] = {s->x, s->y, s->z};
    const Real *const h[3][3] = {
        {s->hxx, s->hxy, s->hxz}, {s->hyx, s->hyy, s->hyz}, {s->hzx, s->hzy, s->hzz}};
    for (int row = 0; row < 3; row++) {
        for (int pair = 0; pair < 3; pair++) {
            double sums[3][6];
            moments(at[pair], at[(pair + 1) % 3], foot_end(foot), h[row][0], h[row][1], h[row][2],
                    sums);
            for (int k = 0; k < 18; k++) {
                M[row][k / 6][place[pair][k % 6]] = sums[k / 6][k % 6];
            }
        }
    }
}

/* torque += p x I */
static void shell_cross(const double *p, const double *I, double *torque) {
    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        torque[k] += p[i] * I[j] - p[j] * I[i];
    }
}

void shell_hessian(const FootScratch *foot, double *H) {
    static const int product[4][4] = {{0, 1, 2, 3}, {1, 4, 5, 9}, {2, 5, 6, 7}, {3, 9, 7, 8}};
    ShellMoments M;
    shell_moments(foot, M);
    memset(H, 0, 36 * sizeof *H);
    for (int k = 0; k < 4; k++) {
        double rows[3][6] = {{0.0}};
        for (int r = 0; r < 3; r++) {
            for (int l = 0; l < 4; l++) {
                const int at = product[k][l];
                shell_cross(foot->lever[l],
                            (const double[3]){M[r][0][at], M[r][1][at], M[r][2][at]}, rows[r] + 3);
            }
            for (int c = 0; c < 3; c++) {
                rows[r][c] = M[r][c][k];
            }
        }
        for (int c = 0; c < 6; c++) { /* column c of the rows is a force: k = 0 adds it, too */
            const double force[3] = {rows[0][c], rows[1][c], rows[2][c]};
            double torque[3] = {0.0};
            shell_cross(foot->lever[k], force, torque);
            for (int r = 0; r < 3; r++) {
                H[6 * r + c] += k == 0 ? force[r] : 0.0;
                H[6 * (3 + r) + c] += torque[r];
            }
        }
    }
}
