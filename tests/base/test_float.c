/* Rounding to float happens, whatever the compiler makes of neighbouring numbers: results are held
 * against the definition, by the bits of the double. */
#include "base/random.h"
#include "kit.h"
#include "round.h"

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
