/* Random numbers: known answers of the published generator, numbers from its bits, independence of
 * neighbours in seed, stream, step and use. */
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

TEST_MAIN(NULL, NULL)
