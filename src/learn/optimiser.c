#include "learn/optimiser.h"

#include "learn/product.h"

/* ---- Adam ---- */

void adam_apply(AdamStep step, int64_t count, const float *restrict gradient,
                float *restrict parameters, float *restrict first, float *restrict second) {
#pragma omp simd
    for (int64_t i = 0; i < count; i++) {
        adam_element(step, gradient[i], &parameters[i], &first[i], &second[i]);
    }
}

/* ---- Muon ---- */

MuonMatrices muon_matrices(const Network *network) {
    MuonMatrices all = {0};
    for (int i = 0; i < NETWORK_MLPS; i++) {
        const char *name;
        const Mlp *mlp = network_mlp(network, i, &name);
        for (int l = 1; l < mlp->layers - 1; l++) {
            const MlpLayer *layer = &mlp->layer[l];
            const int widest = layer->in > layer->out ? layer->in : layer->out;
            all.matrix[all.count++] = (MuonMatrix){.rows = layer->out,
                                                   .columns = layer->in,
                                                   .at = layer->weight,
                                                   .scale = 0.2f * sqrtf((float)widest)};
        }
    }
    return all;
}

/* What an iteration writes. */
typedef struct {
    float *next;          /* [rows][columns] */
    float *gram, *square; /* [side][side], side = min(rows, columns): A, then A A and P */
} Work;

static Work carve(const MuonMatrix *m, float *block, size_t *used) {
    const size_t side = (size_t)(m->rows < m->columns ? m->rows : m->columns);
    Work work;
    work.next = mlp_carve(block, used, (size_t)m->rows * (size_t)m->columns);
    work.gram = mlp_carve(block, used, side * side);
    work.square = mlp_carve(block, used, side * side);
    return work;
}

size_t muon_work_floats(const MuonMatrices *matrices) {
    size_t most = 0;
    for (int i = 0; i < matrices->count; i++) {
        size_t used = 0;
        carve(&matrices->matrix[i], NULL, &used);
        most = used > most ? used : most;
    }
    return most;
}

/* P in the place of A A. */
static void make_polynomial(int side, int is_first, const float *gram, float *square) {
    double trace = 0.0;
    for (int i = 0; i < side; i++) {
        trace += (double)gram[i * side + i];
    }
    const float s = is_first ? muon_shrink(trace) : 1.0f;
    for (int i = 0; i < side * side; i++) {
        square[i] = muon_polynomial(s, i % (side + 1) == 0, gram[i], square[i]);
    }
}

/* Of the two matrices X X^T and X^T X the smaller one serves: P(X X^T) X = X P(X^T X). */
float *muon_orthogonalise(const MuonMatrix *m, float *x, float *block) {
    const int is_wide = m->rows <= m->columns, side = is_wide ? m->rows : m->columns,
              width = is_wide ? m->columns : m->rows;
    size_t used = 0;
    Work work = carve(m, block, &used);
    for (int k = 0; k < MUON_ITERATIONS; k++) {
        float *next = work.next;
        product(is_wide ? 'N' : 'T', is_wide ? 'T' : 'N', side, side, width, x, m->columns, x,
                m->columns, 0.0f, work.gram, side);
        product('N', 'N', side, side, side, work.gram, side, work.gram, side, 0.0f, work.square,
                side);
        make_polynomial(side, k == 0, work.gram, work.square);
        product('N', 'N', m->rows, m->columns, side, is_wide ? work.square : x, side,
                is_wide ? x : work.square, m->columns, 0.0f, next, m->columns);
        work.next = x;
        x = next;
    }
    return x;
}

void muon_apply(const MuonMatrix *m, double rate, float gradient_scale, float *gradient,
                float *parameters, float *momentum, float *work) {
    const int count = m->rows * m->columns;
    const float step = (float)rate * m->scale;
    float *x = gradient + m->at, *w = parameters + m->at;
    for (int i = 0; i < count; i++) {
        x[i] = muon_direction(gradient_scale * x[i], &momentum[m->at + i]);
    }
    x = muon_orthogonalise(m, x, work);
    if (!isfinite(x[0])) {
        return; /* a product found no memory, which makes all of x NaN */
    }
    for (int i = 0; i < count; i++) {
        w[i] -= step * x[i];
    }
}
