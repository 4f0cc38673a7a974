#include "identify/inverse.h"

/* Gauss-Jordan elimination without pivoting. */
int inverse_find(double a[INVERSE_MAX][INVERSE_MAX], int n,
                 double inverse[INVERSE_MAX][INVERSE_MAX]) {
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            inverse[i][j] = i == j;
        }
    }
    for (int k = 0; k < n; k++) {
        if (!(a[k][k] > 1e-14)) {
            return 0;
        }
        double pivot = 1 / a[k][k];
        for (int j = 0; j < n; j++) {
            a[k][j] *= pivot;
            inverse[k][j] *= pivot;
        }
        for (int i = 0; i < n; i++) {
            double factor = a[i][k];
            for (int j = 0; j < n && i != k; j++) {
                a[i][j] -= factor * a[k][j];
                inverse[i][j] -= factor * inverse[k][j];
            }
        }
    }
    return 1;
}
