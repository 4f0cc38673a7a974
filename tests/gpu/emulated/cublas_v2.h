/* A stand-in for cuBLAS as far as src/gpu calls it. */
#ifndef MILD_EMULATED_CUBLAS_H
#define MILD_EMULATED_CUBLAS_H

#include "cuda_runtime_api.h"

typedef struct EmulatedBlas *cublasHandle_t;
typedef enum { CUBLAS_STATUS_SUCCESS } cublasStatus_t;
typedef enum { CUBLAS_OP_N, CUBLAS_OP_T } cublasOperation_t;

static inline const char *cublasGetStatusString(cublasStatus_t status) {
    (void)status;
    return "CUBLAS_STATUS_SUCCESS";
}
static inline cublasStatus_t cublasCreate(cublasHandle_t *handle) {
    *handle = NULL;
    return CUBLAS_STATUS_SUCCESS;
}
static inline cublasStatus_t cublasDestroy(cublasHandle_t handle) {
    (void)handle;
    return CUBLAS_STATUS_SUCCESS;
}
static inline cublasStatus_t cublasSetStream(cublasHandle_t handle, cudaStream_t stream) {
    (void)handle, (void)stream;
    return CUBLAS_STATUS_SUCCESS;
}

/* C = alpha op(A) op(B) + beta C by its definition, column-major: X(i, j) = x[i + j ldx]. C is not
 * read where beta is 0. */
static inline cublasStatus_t cublasSgemm(cublasHandle_t handle, cublasOperation_t op_a,
                                         cublasOperation_t op_b, int m, int n, int k,
                                         const float *alpha, const float *a, int lda,
                                         const float *b, int ldb, const float *beta, float *c,
                                         int ldc) {
    (void)handle;
    for (long j = 0; j < n; j++) {
        for (long i = 0; i < m; i++) {
            double sum = 0.0;
            for (long l = 0; l < k; l++) {
                double a_il = (double)(op_a == CUBLAS_OP_N ? a[i + l * lda] : a[l + i * lda]);
                double b_lj = (double)(op_b == CUBLAS_OP_N ? b[l + j * ldb] : b[j + l * ldb]);
                sum += a_il * b_lj;
            }
            float *to = &c[i + j * ldc];
            *to = *alpha * (float)sum + (*beta == 0.0f ? 0.0f : *beta * *to);
        }
    }
    return CUBLAS_STATUS_SUCCESS;
}

#endif
