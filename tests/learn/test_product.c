/* Products, against their definition in double. */
#include "../kit.h"

#include "base/random.h"
#include "learn/product.h"

enum { MOST = 96 }; /* of m, n, k and the leading dimensions */

static float *numbers(uint64_t seed) {
    Random random = random_at(seed, 1, 2);
    float *x = malloc(MOST * MOST * sizeof *x);
    assert_non_null(x);
    for (int i = 0; i < MOST * MOST; i++) {
        x[i] = (float)random_normal(&random);
    }
    return x;
}

/* To eight binary digits, ties to even. */
static double rounded(double x) {
    int exponent;
    const double fraction = frexp(x, &exponent);
    return ldexp(rint(ldexp(fraction, 8)), exponent - 8);
}

static double exact(double x) {
    return x;
}

typedef struct {
    int m, n, k, room; /* room: floats between rows beyond their own */
    char a, b;
    float beta;
} Case;

/* Largest difference of a product from its definition with factors of `of`, over the sum of the
 * sizes of what it adds; and nothing is written beyond a row's end. */
static double apart(Case s, double (*of)(double)) {
    float *a = numbers(1), *b = numbers(2), *c = numbers(3), *before = numbers(3);
    const int lda = (s.a == 'T' ? s.m : s.k) + s.room, ldb = (s.b == 'T' ? s.k : s.n) + s.room,
              ldc = s.n + s.room;
    product(s.a, s.b, s.m, s.n, s.k, a, lda, b, ldb, s.beta, c, ldc);
    double worst = 0.0;
    for (int i = 0; i < s.m; i++) {
        for (int j = 0; j < ldc; j++) {
            double sum = 0.0, size = 1e-30;
            for (int l = 0; j < s.n && l < s.k; l++) {
                const double x = of((double)a[s.a == 'T' ? l * lda + i : i * lda + l]) *
                                 of((double)b[s.b == 'T' ? j * ldb + l : l * ldb + j]);
                sum += x;
                size += fabs(x);
            }
            const double kept = (double)before[i * ldc + j] * (j < s.n ? (double)s.beta : 1.0);
            worst = fmax(worst, fabs((double)c[i * ldc + j] - sum - kept) / (size + fabs(kept)));
        }
    }
    free(a);
    free(b);
    free(c);
    free(before);
    return worst;
}

static double worst_of(double (*of)(double)) {
    static const int sizes[][3] = {{1, 1, 1}, {3, 5, 7}, {64, 32, 48}, {43, 47, 74}, {12, 80, 1}};
    static const char ways[] = "NT";
    double worst = 0.0;
    for (int i = 0; i < 5 * 2 * 2 * 2 * 2; i++) {
        const int *size = sizes[i / 16];
        const Case s = {size[0],
                        size[1],
                        size[2],
                        i / 8 % 2 ? 9 : 0,
                        ways[i / 4 % 2],
                        ways[i / 2 % 2],
                        i % 2 ? 1.0f : 0.0f};
        worst = fmax(worst, apart(s, of));
    }
    return worst;
}

TEST(products_are_their_definition) {
    const int entered = product_enter(0);
    assert_true(worst_of(exact) < 1e-6);
    product_leave(entered);
}

/* Bool: of the processor, as Linux says. AMX comes with AVX512_BF16. */
static int has_bf16(void) {
    char line[8192];
    int has = 0;
    FILE *file = fopen("/proc/cpuinfo", "r");
    while (file && !has && fgets(line, sizeof line, file)) {
        has = strstr(line, "avx512_bf16") != NULL;
    }
    if (file) {
        fclose(file);
    }
    return has;
}

/* Where the processor multiplies bfloat16; elsewhere they are those of float. */
TEST(factors_are_rounded_between_enter_and_leave) {
    const int has = has_bf16(), entered = product_enter(1);
    print_message("this processor multiplies %s\n", has ? "bfloat16" : "no bfloat16");
    assert_true(worst_of(has ? rounded : exact) < 1e-6);
    assert_true(!has || worst_of(exact) > 1e-3);
    product_leave(entered);
    assert_true(worst_of(exact) < 1e-6);
}

TEST(nan_stays) {
    static const uint32_t bits[] = {0x7fffffffu, 0xffffffffu, 0x7fc00000u, 0x7f800001u};
    for (size_t i = 0; i < sizeof bits / sizeof *bits; i++) {
        float a[4] = {1.0f, 0.0f, 1.0f, 1.0f}, b[2] = {1.0f, 1.0f}, c[2];
        memcpy(&a[1], &bits[i], sizeof a[1]);
        const int entered = product_enter(1);
        product('N', 'N', 2, 1, 2, a, 2, b, 1, 0.0f, c, 1);
        product_leave(entered);
        assert_true(isnan(c[0]) && c[1] == 2.0f);
    }
}

TEST_MAIN(NULL, NULL)
