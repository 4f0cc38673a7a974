#define _GNU_SOURCE /* RTLD_DEFAULT */
#include "learn/product.h"

#include <dlfcn.h>
#include <execinfo.h>
#include <math.h>
#include <oneapi/dnnl/dnnl.h>
#include <string.h>

/* OpenMP's two calls, as its specification declares them: clang comes without omp.h. They set the
 * calling thread only. */
extern void omp_set_num_threads(int threads);
extern int omp_get_max_threads(void);

static _Thread_local int rounds; /* bool: to bfloat16 */

int product_enter(int bf16) {
    rounds = bf16 && product_has_bf16();
    int before = omp_get_max_threads();
    omp_set_num_threads(1);
    return before;
}

void product_leave(int entered) {
    rounds = 0;
    omp_set_num_threads(entered);
}

void product_on_exception(void (*fatal)(void)) {
    void (*(*set_terminate)(void (*)(void)))(void);
    void *symbol = dlsym(RTLD_DEFAULT, "_ZSt13set_terminatePFvvE"); /* std::set_terminate */
    void *frame;
    backtrace(&frame, 1); /* glibc loads its unwinder at the first use, which needs memory */
    if (symbol) {
        memcpy(&set_terminate, &symbol, sizeof symbol);
        set_terminate(fatal);
    }
}

void product(char transpose_a, char transpose_b, int m, int n, int k, const float *a, int lda,
             const float *b, int ldb, float beta, float *c, int ldc) {
    if (rounds && !product_bf16(transpose_a, transpose_b, m, n, k, a, lda, b, ldb, beta, c, ldc)) {
        return;
    }
    if (!rounds && dnnl_sgemm(transpose_a, transpose_b, m, n, k, 1.0f, a, lda, b, ldb, beta, c,
                              ldc) == dnnl_success) {
        return;
    }
    for (int i = 0; i < m; i++) {
        for (int j = 0; j < n; j++) {
            c[(long)i * ldc + j] = NAN;
        }
    }
}
