/* Muon against singular values by Jacobi's rotations, in double. */
#include "check.h"

#include <math.h>
#include <stdlib.h>

#include "learn/optimiser.h"

enum { MOST = 96 * 96 };

/* Rotates the columns of a [rows][columns] until they are orthogonal (Hestenes 1958): a becomes
 * U S, and v [columns][columns] V, of U S V^T. */
static void jacobi(int rows, int columns, double *a, double *v) {
    for (int i = 0; i < columns * columns; i++) {
        v[i] = i % (columns + 1) == 0;
    }
    for (int sweep = 0; sweep < 30; sweep++) {
        for (int p = 0; p < columns; p++) {
            for (int q = p + 1; q < columns; q++) {
                double pp = 0.0, qq = 0.0, pq = 0.0;
                for (int i = 0; i < rows; i++) {
                    const double x = a[i * columns + p], y = a[i * columns + q];
                    pp += x * x, qq += y * y, pq += x * y;
                }
                const double angle = 0.5 * atan2(2.0 * pq, pp - qq), c = cos(angle), s = sin(angle);
                for (int i = 0; i < rows + columns; i++) {
                    double *row = i < rows ? a + i * columns : v + (i - rows) * columns;
                    const double x = row[p], y = row[q];
                    row[p] = c * x + s * y, row[q] = c * y - s * x;
                }
            }
        }
    }
}

static double length(int rows, int columns, const double *a, int column) {
    double squares = 0.0;
    for (int i = 0; i < rows; i++) {
        squares += a[i * columns + column] * a[i * columns + column];
    }
    return sqrt(squares);
}

/* What five iterations make of a singular value. */
static double after(double x) {
    for (int k = 0; k < 5; k++) {
        x = 3.4445 * x - 4.7750 * x * x * x + 2.0315 * x * x * x * x * x;
    }
    return x;
}

/* x as double, transposed if it is wide, so that it has no more columns than rows. */
static void stand(const MuonMatrix *m, const float *x, double *tall) {
    for (int i = 0; i < m->rows * m->columns; i++) {
        const int row = i / m->columns, column = i % m->columns;
        tall[m->rows < m->columns ? column * m->rows + row : i] = (double)x[i];
    }
}

typedef struct {
    double least, most; /* singular values of the result */
    double apart;       /* of the result from U f(S / |S|) V^T, over its length */
    double smallest;    /* of S / |S| */
} Found;

static Found orthogonalise(const MuonMatrix *m, const float *given) {
    static float x[MOST], work[3 * MOST] __attribute__((aligned(64)));
    static double a[MOST], v[MOST], result[MOST], turned[MOST];
    const int count = m->rows * m->columns, is_wide = m->rows < m->columns,
              rows = is_wide ? m->columns : m->rows, columns = is_wide ? m->rows : m->columns;
    memcpy(x, given, (size_t)count * sizeof *x);
    stand(m, muon_orthogonalise(m, x, work), result);
    stand(m, given, a);
    jacobi(rows, columns, a, v);
    double norm = 0.0, gap = 0.0, size = 0.0;
    Found found = {.least = 1e9, .smallest = 1.0};
    for (int k = 0; k < columns; k++) {
        norm = hypot(norm, length(rows, columns, a, k));
    }
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < columns; j++) {
            double wanted = 0.0;
            for (int k = 0; k < columns; k++) {
                const double s = length(rows, columns, a, k);
                wanted +=
                    s > 0.0 ? a[i * columns + k] / s * after(s / norm) * v[j * columns + k] : 0.0;
            }
            gap = hypot(gap, result[i * columns + j] - wanted);
            size = hypot(size, wanted);
        }
    }
    found.apart = gap / fmax(size, 1e-30);
    for (int k = 0; k < columns; k++) {
        found.smallest = fmin(found.smallest, length(rows, columns, a, k) / fmax(norm, 1e-30));
    }
    jacobi(rows, columns, result, turned);
    for (int k = 0; k < columns; k++) {
        const double s = length(rows, columns, result, k);
        found.least = fmin(found.least, s);
        found.most = fmax(found.most, s);
    }
    return found;
}

/* Wide, tall and square, of any length: singular values near 1, and the vectors that they had. */
TEST(singular_values_come_near_one) {
    static const int sizes[][2] = {{32, 96}, {96, 32}, {20, 20}, {7, 5}, {1, 9}, {9, 1}};
    static const double scales[] = {1.0, 1e-4, 1e4};
    static float x[MOST];
    Random random = random_at(1, 2, 3);
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        const MuonMatrix m = {.rows = sizes[i][0], .columns = sizes[i][1]};
        for (int s = 0; s < 3; s++) {
            fill_normal(x, m.rows * m.columns, scales[s], &random);
            for (int k = 0; k < m.rows && k < m.columns; k++) { /* no singular value is near 0 */
                x[k * (m.columns + 1)] += (float)(5.0 * scales[s]);
            }
            const Found found = orthogonalise(&m, x);
            assert_true(found.smallest > 0.0015);
            assert_true(found.least > 0.6 && found.most < 1.3);
            assert_true(found.apart < (scales[s] < 1.0 ? 1e-3 : 1e-5)); /* Jordan's 1e-7 */
        }
    }
}

/* One direction becomes f(1) long and makes no other; nothing stays nothing. */
TEST(directions_that_are_missing_stay_so) {
    const MuonMatrix m = {.rows = 12, .columns = 30};
    static float x[MOST], none[MOST];
    for (int i = 0; i < m.rows * m.columns; i++) {
        x[i] = (float)((i / m.columns + 1) * cos(i % m.columns));
    }
    const Found found = orthogonalise(&m, x), nothing = orthogonalise(&m, none);
    assert_true(fabs(found.most - after(1.0)) < 1e-4 && found.least < 1e-3);
    assert_true(nothing.most == 0.0);
}

/* Between hidden layers alone: not where a network reads its input or gives its output. */
TEST(matrices_lie_between_hidden_layers) {
    static const int sizes[][2] = {{8, 12}, {9, 6}, {10, 16}, {8, 10}, {7, 11}, {6, 7}};
    PolicyDef def = small_def();
    Network n;
    assert_int_equal(network_layout(&n, &def, NULL), MILD_OK);
    const MuonMatrices muon = muon_matrices(&n);
    const int64_t at[] = {n.encoder.layer[1].weight, n.decoder.layer[1].weight,
                          n.actor.layer[1].weight,   n.actor.layer[2].weight,
                          n.critic.layer[1].weight,  n.critic.layer[2].weight};
    assert_int_equal(muon.count, 6);
    for (int i = 0; i < 6; i++) {
        const MuonMatrix *m = &muon.matrix[i];
        assert_int_equal(m->rows, sizes[i][0]);
        assert_int_equal(m->columns, sizes[i][1]);
        assert_true(m->at == at[i]);
        const double most = fmax(m->rows, m->columns);
        assert_true(fabs((double)m->scale * (double)m->scale - 0.04 * most) < 1e-6 * most);
    }
}

/* A product that finds no memory is NaN everywhere, and then the matrix stays where it is. */
TEST(what_is_no_number_moves_nothing) {
    const MuonMatrix m = {.rows = 4, .columns = 5, .at = 2, .scale = 1.0f};
    float gradient[24], parameters[24], momentum[24] = {0}, work[256] __attribute__((aligned(64)));
    for (int bad = 0; bad < 2; bad++) {
        for (int i = 0; i < 24; i++) {
            gradient[i] = (float)(i % 7);
            parameters[i] = 1.0f;
        }
        gradient[9] = bad ? NAN : gradient[9];
        muon_apply(&m, 1e-2, 1.0f, gradient, parameters, momentum, work);
        for (int i = 0; i < 24; i++) {
            assert_true((parameters[i] == 1.0f) == (bad || i < 2 || i >= 22));
        }
    }
}

TEST_MAIN(NULL, NULL)
