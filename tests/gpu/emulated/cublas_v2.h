/* A stand-in for cuBLAS as far as src/learn/cuda calls it. */
#ifndef MILD_EMULATED_CUBLAS_H
#define MILD_EMULATED_CUBLAS_H

#include "cuda_runtime_api.h"

typedef struct EmulatedBlas *cublasHandle_t;
typedef enum { CUBLAS_STATUS_SUCCESS, CUBLAS_STATUS_EXECUTION_FAILED } cublasStatus_t;
typedef enum { CUBLAS_OP_N, CUBLAS_OP_T } cublasOperation_t;
typedef enum {
    CUBLAS_COMPUTE_32F,
    CUBLAS_COMPUTE_32F_FAST_TF32,
    CUBLAS_COMPUTE_32F_FAST_16BF
} cublasComputeType_t;
typedef enum { CUDA_R_32F, CUDA_R_16BF } cudaDataType_t;
enum { CUBLAS_GEMM_DEFAULT };

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

static inline cublasStatus_t cublasSetWorkspace(cublasHandle_t handle, void *workspace,
                                                size_t bytes) {
    (void)handle, (void)workspace, (void)bytes;
    return CUBLAS_STATUS_SUCCESS;
}

static inline float emulated_number(const void *x, cudaDataType_t type, long i) {
    const unsigned bits = type == CUDA_R_16BF ? (unsigned)((const unsigned short *)x)[i] << 16 : 0;
    float value = type == CUDA_R_16BF ? 0.0f : ((const float *)x)[i];
    if (type == CUDA_R_16BF) {
        memcpy(&value, &bits, sizeof value);
    }
    return value;
}

/* bfloat16 by the nearest, ties to even. */
static inline void emulated_write(void *x, cudaDataType_t type, long i, float value) {
    unsigned bits;
    if (type == CUDA_R_32F) {
        ((float *)x)[i] = value;
        return;
    }
    memcpy(&bits, &value, sizeof bits);
    bits = value == value ? bits + 0x7fffu + (bits >> 16 & 1u) : 0x7fc00000u;
    ((unsigned short *)x)[i] = (unsigned short)(bits >> 16);
}

/* C = alpha op(A) op(B) + beta C by its definition, column-major: X(i, j) = x[i + j ldx]. C is not
 * read where beta is 0. */
static inline cublasStatus_t cublasGemmEx(cublasHandle_t handle, cublasOperation_t op_a,
                                          cublasOperation_t op_b, int m, int n, int k,
                                          const void *alpha, const void *a, cudaDataType_t a_type,
                                          int lda, const void *b, cudaDataType_t b_type, int ldb,
                                          const void *beta, void *c, cudaDataType_t c_type, int ldc,
                                          cublasComputeType_t arithmetic, int algorithm) {
    (void)handle, (void)arithmetic, (void)algorithm;
    const float scale = *(const float *)alpha, kept = *(const float *)beta;
    double *sum = (double *)malloc((size_t)m * sizeof *sum);
    for (long j = 0; j < n; j++) {
        for (long i = 0; i < m; i++) {
            sum[i] = 0.0;
        }
        for (long l = 0; l < k; l++) { /* in this order the inner loop reads neighbours, or few */
            const double b_lj =
                (double)emulated_number(b, b_type, op_b == CUBLAS_OP_N ? l + j * ldb : j + l * ldb);
            const long row = op_a == CUBLAS_OP_N ? 1 : lda, column = op_a == CUBLAS_OP_N ? lda : 1;
            for (long i = 0; i < m; i++) {
                sum[i] += (double)emulated_number(a, a_type, i * row + l * column) * b_lj;
            }
        }
        for (long i = 0; i < m; i++) {
            const long to = i + j * ldc;
            const float before = kept == 0.0f ? 0.0f : kept * emulated_number(c, c_type, to);
            emulated_write(c, c_type, to, scale * (float)sum[i] + before);
        }
    }
    free(sum);
    return CUBLAS_STATUS_SUCCESS;
}

/* Of floats. */
static inline cublasStatus_t
cublasGemmStridedBatchedEx(cublasHandle_t handle, cublasOperation_t op_a, cublasOperation_t op_b,
                           int m, int n, int k, const void *alpha, const void *a,
                           cudaDataType_t a_type, int lda, long long a_stride, const void *b,
                           cudaDataType_t b_type, int ldb, long long b_stride, const void *beta,
                           void *c, cudaDataType_t c_type, int ldc, long long c_stride, int count,
                           cublasComputeType_t arithmetic, int algorithm) {
    for (long long i = 0; i < count; i++) {
        cublasGemmEx(handle, op_a, op_b, m, n, k, alpha, (const float *)a + i * a_stride, a_type,
                     lda, (const float *)b + i * b_stride, b_type, ldb, beta,
                     (float *)c + i * c_stride, c_type, ldc, arithmetic, algorithm);
    }
    return CUBLAS_STATUS_SUCCESS;
}

#endif
