/* Frames in 16 bits, as IEEE 754 has them. */
#include "kit.h"

#define MILD_REAL_FLOAT
#include "env/task/numbers.h"

/* Numbers and their bits by the tables of IEEE 754-2008 binary16; ties go to even. */
TEST(known_numbers) {
    static const struct {
        float number;
        uint16_t bits;
    } known[] = {{0, 0x0000},          {1, 0x3c00},          {-2, 0xc000},
                 {0.1f, 0x2e66},       {1.0f / 3, 0x3555},   {65504, 0x7bff},
                 {-1e6f, 0xfbff},      {0x1p-14f, 0x0400},   {0x1p-24f, 0x0001},
                 {-0x1p-15f, 0x8200},  {0x1.002p0f, 0x3c00}, {0x1.006p0f, 0x3c02},
                 {0x1.ffep0f, 0x4000}, {1e-9f, 0x0000}};
    for (size_t i = 0; i < sizeof known / sizeof *known; i++) {
        assert_int_equal(frame_pack(known[i].number), known[i].bits);
    }
}

TEST(rounding) {
    for (float x = 1e-4f; x < 6e4f; x *= 1.0007f) {
        for (int sign = -1; sign <= 1; sign += 2) {
            const float y = (float)sign * x;
            assert_true(fabsf(frame_unpack(frame_pack(y)) - y) <= 0x1p-11f * x);
        }
    }
    for (unsigned bits = 0; bits < 0x7c00; bits++) { /* what has 16 bits comes back */
        assert_int_equal(frame_pack(frame_unpack((uint16_t)bits)), bits);
    }
}

TEST_MAIN(NULL, NULL)
