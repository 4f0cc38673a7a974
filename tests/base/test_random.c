/* Random numbers: known answers of the published generator, moments, independence of what is drawn
 * for different seeds, streams, steps and uses. */
#include "base/random.h"
#include "kit.h"

enum { COUNT = 200000 };

/* Inverse of random_mix: shifts are undone by repeating them, products by the factor's inverse
 * modulo 2^64, found by Newton's iteration. */
static uint64_t unshift(uint64_t x, int by) {
    uint64_t y = x;
    for (int done = by; done < 64; done += by) {
        y = x ^ (y >> by);
    }
    return y;
}

static uint64_t inverse(uint64_t a) {
    uint64_t x = a;
    for (int i = 0; i < 6; i++) {
        x *= 2 - a * x;
    }
    return x;
}

static uint64_t unmix(uint64_t x) {
    x = unshift(x, 31) * inverse(0x94d049bb133111ebu);
    x = unshift(x, 27) * inverse(0xbf58476d1ce4e5b9u);
    return unshift(x, 30);
}

/* Philox 2x32-10 of the published known answers (Random123, kat_vectors): counter, key, result.
 * Seeds are chosen so that our key schedule ends at that key. */
TEST(test_known_answers) {
    static const uint32_t kat[3][5] = {
        {0, 0, 0, 0xff1dae59, 0x6cd10df2},
        {0xffffffff, 0xffffffff, 0xffffffff, 0x2c3f628b, 0xab4fd7ad},
        {0x243f6a88, 0x85a308d3, 0x13198a2e, 0xdd7ce038, 0xf62a4c12},
    };
    static const uint32_t streams[] = {0, 1, 12345, 0xffffffff}, highs[] = {0, 1, 0xdeadbeef};
    for (int k = 0; k < 3; k++) {
        for (int s = 0; s < 4; s++) {
            for (int h = 0; h < 3; h++) {
                uint64_t mixed = (uint64_t)highs[h] << 32 | (kat[k][2] ^ highs[h]);
                Random r = {.stream = streams[s], .step = kat[k][0]};
                r.seed = unmix(mixed) - 0x9e3779b97f4a7c15u * ((uint64_t)streams[s] + 1);
                r.use = kat[k][1] ^ highs[h] * 0x9e3779b9u;
                uint32_t use = r.use;
                uint64_t bits = random_bits(&r);
                assert_true(bits == ((uint64_t)kat[k][3] << 32 | kat[k][4]));
                assert_true(r.use == use + 1);
            }
        }
    }
}

TEST(test_same_place_same_number) {
    Random a = random_at(5, 6, 7);
    assert_true(a.seed == 5 && a.stream == 6 && a.step == 7 && a.use == 0);
    Random b = a;
    for (int i = 0; i < 10; i++) {
        assert_true(random_bits(&a) == random_bits(&b));
    }
}

/* Mean of x, x^2, x^3, x^4 against those of the distribution, in standard errors. */
static void check_moments(const char *what, double (*draw)(Random *), const double wanted[4],
                          const double spread[4]) {
    Random r = random_at(1, 2, 3);
    double sum[4] = {0};
    for (int i = 0; i < COUNT; i++) {
        double x = draw(&r);
        sum[0] += x;
        sum[1] += x * x;
        sum[2] += x * x * x;
        sum[3] += x * x * x * x;
    }
    for (int k = 0; k < 4; k++) {
        double errors = (sum[k] / COUNT - wanted[k]) / (spread[k] / sqrt(COUNT));
        printf("%s, moment %d: %.5f, %+.1f standard errors\n", what, k + 1, sum[k] / COUNT, errors);
        assert_true(fabs(errors) < 4);
    }
}

/* Moment k of U(0,1) is 1/(k+1); of N(0,1) 0, 1, 0, 3. Spread: square root of moment 2k less the
 * square of moment k. */
TEST(test_moments) {
    static const double unit[4] = {1.0 / 2, 1.0 / 3, 1.0 / 4, 1.0 / 5};
    static const double normal[4] = {0, 1, 0, 3};
    double unit_spread[4], normal_spread[4] = {1, sqrt(2), sqrt(15), sqrt(105 - 9)};
    for (int k = 1; k <= 4; k++) {
        unit_spread[k - 1] = sqrt(1.0 / (2 * k + 1) - 1.0 / ((k + 1) * (k + 1)));
    }
    check_moments("uniform", random_unit, unit, unit_spread);
    check_moments("normal", random_normal, normal, normal_spread);
}

/* The number from the bits, by hand. */
TEST(test_conversions) {
    for (uint32_t step = 0; step < 1000; step++) {
        Random bits = random_at(3, 4, step), r = bits;
        uint64_t first = random_bits(&bits), second = random_bits(&bits);
        double u = (double)(first >> 11) / 9007199254740992.0; /* 2^53 */
        double v = (double)(second >> 11) / 9007199254740992.0;
        Random unit = r, uniform = r, normal = r, die = r;
        assert_true(random_unit(&unit) == u && u < 1);
        assert_true(fabs(random_uniform(&uniform, -3, 2) - (-3 + 5 * u)) < 1e-15);
        double wanted = sqrt(-2 * log1p(-u)) * cos(8 * atan(1) * v);
        assert_true(fabs(random_normal(&normal) - wanted) < 1e-12);
        assert_int_equal(random_index(&die, 6), (int)floor(6 * ldexp((double)(first >> 32), -32)));
    }
}

/* Every face of a die of 7 as often as any other: chi squared of 6 degrees of freedom is above 22.5
 * once in a thousand. */
TEST(test_index) {
    Random r = random_at(8, 0, 0);
    int count[7] = {0};
    for (int i = 0; i < 70000; i++) {
        uint32_t face = random_index(&r, 7);
        assert_true(face < 7);
        count[face]++;
    }
    double chi = 0;
    for (int i = 0; i < 7; i++) {
        chi += (count[i] - 10000.0) * (count[i] - 10000.0) / 10000;
    }
    printf("die of 7: chi squared %.1f\n", chi);
    assert_true(chi < 22.5);
    assert_int_equal(random_index(&r, 1), 0);
}

/* A number and its neighbour in seed, stream, step or use do not know of each other: correlation of
 * the values, and half of the bits differ. */
TEST(test_neighbours) {
    static const char *const names[] = {"seed", "stream", "step", "use"};
    for (int kind = 0; kind < 4; kind++) {
        double product = 0, bits = 0;
        for (uint32_t i = 0; i < COUNT; i++) {
            uint32_t at[4] = {11, 12, 13, 14};
            at[kind] = i;
            Random a = {at[0], at[1], at[2], at[3]};
            at[kind]++;
            Random b = {at[0], at[1], at[2], at[3]};
            uint64_t x = random_bits(&a), y = random_bits(&b);
            bits += __builtin_popcountll(x ^ y);
            product += (ldexp((double)x, -64) - 0.5) * (ldexp((double)y, -64) - 0.5);
        }
        double correlation = 12 * product / COUNT * sqrt(COUNT); /* in standard errors */
        double flips = (bits / COUNT - 32) / 4 * sqrt(COUNT);
        printf("next %s: correlation %+.1f, bits that differ %+.1f standard errors\n", names[kind],
               correlation, flips);
        assert_true(fabs(correlation) < 4 && fabs(flips) < 4);
    }
}

static int compare(const void *a, const void *b) {
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return x < y ? -1 : x > y;
}

/* No two of 32 seeds x 32 streams x 32 steps x 4 uses give the same 64 bits. */
TEST(test_no_repeats) {
    const size_t count = 32 * 32 * 32 * 4;
    uint64_t *all = malloc(count * sizeof *all);
    assert_non_null(all);
    for (uint32_t i = 0; i < count; i++) {
        Random r = {i % 32, i / 32 % 32, i / 1024 % 32, i / 32768};
        all[i] = random_bits(&r);
    }
    qsort(all, count, sizeof *all, compare);
    for (size_t i = 1; i < count; i++) {
        assert_true(all[i] != all[i - 1]);
    }
    free(all);
}

TEST_MAIN(NULL, NULL)
