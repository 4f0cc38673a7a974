/* Random numbers: known answers of the published generator, numbers from its bits, independence of
 * neighbours in seed, stream, step and use. */
#include "base/random.h"

#include "base/student.h"
#include "draws.h"
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
    const Random at = random_at(5, 6, 7);
    assert_true(at.seed == 5 && at.stream == 6 && at.step == 7 && at.use == 0);
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

/* ---- Student's t against an integral of the density that shares no formula with it ---- */

/* The density integrated by Simpson's rule from 0 to t, over that from 0 to infinity: 0.95. With
 * t = sqrt(n) tan(a) the density is cos(a)^(n-1), up to a constant. */
static double power_integral(int power, double end) {
    enum { STEPS = 20000 };
    double sum = 0;
    for (int i = 0; i <= STEPS; i++) {
        double weight = i == 0 || i == STEPS ? 1 : i % 2 ? 4 : 2;
        sum += weight * pow(cos(end * i / STEPS), power);
    }
    return sum * end / (3 * STEPS);
}

TEST(share_of_the_density) {
    double worst = 0;
    for (int n = 1; n <= 200; n += n < 20 ? 1 : 17) {
        double angle = atan(student_95(n) / sqrt(n));
        double share = power_integral(n - 1, angle) / power_integral(n - 1, acos(-1.0) / 2);
        worst = fmax(worst, fabs(share - 0.95));
    }
    print_message("probability within the 95 %% points, by quadrature: worst %.1e\n", worst);
    assert_true(worst < 1e-12);
}

TEST(no_freedom) {
    assert_true(isnan(student_95(0)));
    assert_true(isnan(student_95(-3)));
}

/* Rounding to float happens, whatever the compiler makes of neighbouring numbers: results are held
 * against the definition, by the bits of the double. */

enum { MOST = 19 };

/* To nearest, ties to even, by integers alone: a float has 29 bits fewer. For normal floats. */
static double nearest(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    bits += (UINT64_C(1) << 28) - 1 + (bits >> 29 & 1);
    bits &= ~((UINT64_C(1) << 29) - 1);
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* As a caller with few numbers writes it, which compilers unroll: the length is a constant. */
#define ROUND(count)                                                                               \
    static void round_##count(double *x) {                                                         \
        kit_round(x, count);                                                                       \
    }
ROUND(1)
ROUND(2)
ROUND(3)
ROUND(4)
ROUND(7)
ROUND(8)
ROUND(9)
ROUND(13)
ROUND(16)

static void round_structure(double *x) {
    const struct {
        double x, y, z, w;
    } four = {float_rounded(x[0]), float_rounded(x[1]), float_rounded(x[2]), float_rounded(x[3])};
    memcpy(x, &four, sizeof four);
}

TEST(each_length_is_rounded) {
    static const struct {
        int count;
        void (*round)(double *x);
    } lengths[] = {{1, round_1},   {2, round_2},        {3, round_3}, {4, round_4},
                   {7, round_7},   {8, round_8},        {9, round_9}, {13, round_13},
                   {16, round_16}, {4, round_structure}};
    Random r = {.seed = 5};
    for (int draw = 0; draw < 1000; draw++) {
        for (size_t l = 0; l < sizeof lengths / sizeof *lengths; l++) {
            double x[MOST], y[MOST];
            for (int i = 0; i < MOST; i++) {
                x[i] = y[i] = ldexp(random_normal(&r), (int)(200 * random_unit(&r)) - 100);
            }
            lengths[l].round(y);
            for (int i = 0; i < MOST; i++) {
                const double expected = i < lengths[l].count ? nearest(x[i]) : x[i];
                if (y[i] != expected) {
                    fail_msg("number %d of %d: %.17g became %.17g, not %.17g", i, lengths[l].count,
                             x[i], y[i], expected);
                }
            }
        }
    }
}

TEST_MAIN(NULL, NULL)
