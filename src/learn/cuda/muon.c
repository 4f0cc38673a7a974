/* Muon's products on the device: muon_orthogonalise for all matrices at once. Padded to one shape
 * they are one batch, which takes fewer and larger launches than a batch for each shape. */
#include "learn/cuda/learner_private.h"

void gpu_muon_list(const Ppo *ppo, const Network *padded, GpuMuon *muon) {
    *muon = (GpuMuon){0};
    if (ppo->muon.count == 0) {
        return;
    }
    muon->list = muon_matrices(padded);
    for (int i = 0; i < muon->list.count; i++) {
        MuonMatrix *m = &muon->list.matrix[i];
        const int is_wide = m->rows <= m->columns, side = is_wide ? m->rows : m->columns,
                  width = is_wide ? m->columns : m->rows;
        m->scale = ppo->muon.matrix[i].scale;
        muon->side = side > muon->side ? side : muon->side;
        muon->width = width > muon->width ? width : muon->width;
    }
}

size_t gpu_muon_carve(char *block, GpuMuon *muon) {
    const size_t count = (size_t)muon->list.count, side = (size_t)muon->side,
                 x = count * side * (size_t)muon->width, square = count * side * side;
    float *at = (float *)(void *)block;
    muon->x = at;
    muon->next = block ? muon->x + x : NULL;
    muon->gram = block ? muon->next + x : NULL;
    muon->square = block ? muon->gram + square : NULL;
    return 2 * (x + square) * sizeof *at;
}

/* c [side][n] = a op(b) for each matrix, row-major, a [side][k]; see product in network.c. bf16 has
 * no floats to multiply but rounded to TF32. */
static void product(GpuLearner *g, char transpose_b, int n, int k, const float *a, const float *b,
                    float *c) {
    GpuQueue *q = &g->queue;
    const int m = g->muon.side;
    const float one = 1.0f, zero = 0.0f;
    const cublasStatus_t status = cublasGemmStridedBatchedEx(
        q->blas, transpose_b == 'T' ? CUBLAS_OP_T : CUBLAS_OP_N, CUBLAS_OP_N, n, m, k, &one, b,
        CUDA_R_32F, transpose_b == 'T' ? k : n, (long long)n * k, a, CUDA_R_32F, k,
        (long long)m * k, &zero, c, CUDA_R_32F, n, (long long)m * n, g->muon.list.count,
        q->weights.bf16 ? CUBLAS_COMPUTE_32F_FAST_TF32 : q->arithmetic, CUBLAS_GEMM_DEFAULT);
    q->status = q->status ? q->status : status;
}

void gpu_enqueue_muon(GpuLearner *g, const GpuOptimiser *optimiser) {
    const GpuMuon *muon = &g->muon;
    const int side = muon->side, width = muon->width;
    float *x = muon->x, *next = muon->next;
    for (int k = 0; k < MUON_ITERATIONS; k++) {
        float *const from = x;
        product(g, 'T', side, width, x, x, muon->gram);
        product(g, 'N', side, side, muon->gram, muon->gram, muon->square);
        gpu_muon_polynomial(g->queue.stream, *muon, k == 0);
        product(g, 'N', width, side, muon->square, x, next);
        x = next;
        next = from;
    }
    gpu_muon_apply(g->queue.stream, *optimiser, x, g->progress);
}
