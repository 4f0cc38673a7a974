#define _GNU_SOURCE /* RTLD_DEFAULT */
#include "learn/product.h"

#include <dlfcn.h>
#include <execinfo.h>
#include <math.h>
#include <oneapi/dnnl/dnnl.h>
#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* ---- bfloat16 ---- */

/* oneDNN's primitives cost more to make than a small product to compute, and one thread may run one
 * at a time: each thread keeps those of the shapes that it has had. A network's training has some
 * hundred. */
#define SHAPES 512

typedef struct {
    int m, n, k, ldc;
    char transpose_a, transpose_b, adds;
} Shape;

typedef struct {
    Shape shape;
    dnnl_primitive_t primitive; /* NULL: none */
    dnnl_memory_t a, b, c;
} Product;

typedef struct {
    dnnl_engine_t engine;
    dnnl_stream_t stream;
    Product product[SHAPES];
    uint16_t *rounded; /* both factors */
    size_t room;
} Thread;

static pthread_once_t once = PTHREAD_ONCE_INIT;
static pthread_key_t key;
static int has_bf16;

/* ---- a product's primitive ---- */

static void product_close(Product *p) {
    dnnl_memory_destroy(p->a);
    dnnl_memory_destroy(p->b);
    dnnl_memory_destroy(p->c);
    dnnl_primitive_destroy(p->primitive);
    memset(p, 0, sizeof *p);
}

/* A factor as it is stored: [rows][columns], or the transpose of that. */
static dnnl_status_t factor(dnnl_memory_desc_t *desc, int rows, int columns, char transpose) {
    const dnnl_dims_t size = {rows, columns},
                      step = {transpose == 'T' ? 1 : columns, transpose == 'T' ? rows : 1};
    return dnnl_memory_desc_init_by_strides(desc, 2, size, dnnl_bf16, step);
}

static dnnl_status_t describe(const Shape *s, dnnl_engine_t engine, dnnl_memory_desc_t desc[3],
                              dnnl_primitive_desc_t *made) {
    const dnnl_dims_t size = {s->m, s->n}, step = {s->ldc, 1};
    dnnl_matmul_desc_t matmul;
    dnnl_primitive_attr_t attributes = NULL;
    dnnl_post_ops_t end = NULL;
    dnnl_status_t status = factor(&desc[0], s->m, s->k, s->transpose_a);
    status = status ? status : factor(&desc[1], s->k, s->n, s->transpose_b);
    status = status ? status : dnnl_memory_desc_init_by_strides(&desc[2], 2, size, dnnl_f32, step);
    status = status ? status : dnnl_matmul_desc_init(&matmul, &desc[0], &desc[1], NULL, &desc[2]);
    status = status ? status : dnnl_primitive_attr_create(&attributes);
    status = status ? status : dnnl_post_ops_create(&end);
    if (!status && s->adds) {
        status = dnnl_post_ops_append_sum(end, 1.0f);
        status = status ? status : dnnl_primitive_attr_set_post_ops(attributes, end);
    }
    status = status ? status : dnnl_primitive_desc_create(made, &matmul, attributes, engine, NULL);
    dnnl_post_ops_destroy(end);
    dnnl_primitive_attr_destroy(attributes);
    return status;
}

static dnnl_status_t product_open(Product *p, const Shape *shape, dnnl_engine_t engine) {
    dnnl_memory_desc_t desc[3];
    dnnl_primitive_desc_t made = NULL;
    dnnl_status_t status = describe(shape, engine, desc, &made);
    status = status ? status : dnnl_primitive_create(&p->primitive, made);
    dnnl_primitive_desc_destroy(made);
    status = status ? status : dnnl_memory_create(&p->a, &desc[0], engine, DNNL_MEMORY_NONE);
    status = status ? status : dnnl_memory_create(&p->b, &desc[1], engine, DNNL_MEMORY_NONE);
    status = status ? status : dnnl_memory_create(&p->c, &desc[2], engine, DNNL_MEMORY_NONE);
    p->shape = *shape;
    if (status) {
        product_close(p);
    }
    return status;
}

/* ---- what a thread keeps ---- */

static void thread_close(void *self) {
    Thread *thread = self;
    for (int i = 0; i < SHAPES; i++) {
        product_close(&thread->product[i]);
    }
    dnnl_stream_destroy(thread->stream);
    dnnl_engine_destroy(thread->engine);
    free(thread->rounded);
    free(thread);
}

/* oneDNN computes bfloat16 on older processors too, many times slower than float. */
static void ask(void) {
    const Shape shape = {.m = 64, .n = 64, .k = 64, .ldc = 64};
    dnnl_memory_desc_t desc[3];
    dnnl_engine_t engine = NULL;
    dnnl_primitive_desc_t made = NULL;
    const char *name = "";
    pthread_key_create(&key, thread_close);
    if (dnnl_engine_create(&engine, dnnl_cpu, 0) == dnnl_success &&
        describe(&shape, engine, desc, &made) == dnnl_success) {
        dnnl_primitive_desc_query(made, dnnl_query_impl_info_str, 0, &name);
        has_bf16 = strstr(name, "core_bf16") != NULL || strstr(name, "amx") != NULL;
    }
    dnnl_primitive_desc_destroy(made);
    dnnl_engine_destroy(engine);
}

/* Bool: this processor multiplies bfloat16. */
static int product_has_bf16(void) {
    pthread_once(&once, ask);
    return has_bf16;
}

static Thread *thread_own(void) {
    pthread_once(&once, ask);
    Thread *thread = pthread_getspecific(key);
    if (thread) {
        return thread;
    }
    thread = calloc(1, sizeof *thread);
    if (thread && (dnnl_engine_create(&thread->engine, dnnl_cpu, 0) != dnnl_success ||
                   dnnl_stream_create(&thread->stream, thread->engine, dnnl_stream_default_flags) !=
                       dnnl_success ||
                   pthread_setspecific(key, thread))) {
        thread_close(thread);
        thread = NULL;
    }
    return thread;
}

static int same(const Shape *a, const Shape *b) {
    return a->m == b->m && a->n == b->n && a->k == b->k && a->ldc == b->ldc &&
           a->transpose_a == b->transpose_a && a->transpose_b == b->transpose_b &&
           a->adds == b->adds;
}

/* NULL: oneDNN cannot make it. */
static Product *product_of(Thread *thread, const Shape *s) {
    const uint32_t parts[] = {(uint32_t)s->m,   (uint32_t)s->n,           (uint32_t)s->k,
                              (uint32_t)s->ldc, (uint32_t)s->transpose_a, (uint32_t)s->transpose_b,
                              (uint32_t)s->adds};
    uint32_t hash = 2166136261u;
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        hash = (hash ^ parts[i]) * 16777619u;
    }
    Product *p = &thread->product[(hash ^ hash >> 16) % SHAPES];
    if (p->primitive && same(&p->shape, s)) {
        return p;
    }
    product_close(p);
    return product_open(p, s, thread->engine) == dnnl_success ? p : NULL;
}

/* ---- rounding ---- */

/* To the nearest, ties to even; NaN stays one. */
static void round_row(int count, const float *restrict from, uint16_t *restrict to) {
#pragma omp simd
    for (int i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &from[i], sizeof bits);
        const uint32_t rounded = (bits + 0x7fffu + (bits >> 16 & 1u)) >> 16;
        to[i] = (uint16_t)((bits & 0x7fffffffu) > 0x7f800000u ? 0x7fc0u : rounded);
    }
}

static void round_rows(int rows, int columns, const float *from, int ld, uint16_t *to) {
    for (int r = 0; r < rows; r++) {
        round_row(columns, from + (int64_t)r * ld, to + (int64_t)r * columns);
    }
}

/* As product, with factors rounded to bfloat16 and sums in float. Returns 0, or 1 when memory runs
 * out or oneDNN fails, with c as it was or partly written. */
static int product_bf16(char transpose_a, char transpose_b, int m, int n, int k, const float *a,
                        int lda, const float *b, int ldb, float beta, float *c, int ldc) {
    const Shape shape = {m, n, k, ldc, transpose_a, transpose_b, beta != 0.0f};
    Thread *thread = thread_own();
    Product *p = thread ? product_of(thread, &shape) : NULL;
    const size_t begin = ((size_t)m * (size_t)k + 31) / 32 * 32, /* of b: a line of the cache */
        wanted = begin + (size_t)k * (size_t)n;
    if (p && thread->room < wanted) {
        free(thread->rounded);
        thread->rounded = aligned_alloc(64, (wanted * sizeof(uint16_t) + 63) / 64 * 64);
        thread->room = thread->rounded ? wanted : 0;
    }
    if (!p || thread->room < wanted) {
        return 1;
    }
    uint16_t *rounded_a = thread->rounded, *rounded_b = rounded_a + begin;
    round_rows(transpose_a == 'T' ? k : m, transpose_a == 'T' ? m : k, a, lda, rounded_a);
    round_rows(transpose_b == 'T' ? n : k, transpose_b == 'T' ? k : n, b, ldb, rounded_b);
    dnnl_memory_set_data_handle(p->a, rounded_a);
    dnnl_memory_set_data_handle(p->b, rounded_b);
    dnnl_memory_set_data_handle(p->c, c);
    const dnnl_exec_arg_t arguments[] = {
        {DNNL_ARG_SRC, p->a}, {DNNL_ARG_WEIGHTS, p->b}, {DNNL_ARG_DST, p->c}};
    return dnnl_primitive_execute(p->primitive, thread->stream, 3, arguments) != dnnl_success ||
           dnnl_stream_wait(thread->stream) != dnnl_success;
}

/* ---- products ---- */

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
