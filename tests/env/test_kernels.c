/* Inside of the batch engine: which kernels of a build a robot takes, the first that fit, and that
 * envs_are_slow says when those are for any robot (the table of the build is not linked here, this
 * one stands in its place); and frames in 16 bits, as IEEE 754 has them. */
#include "robots.h"

#define MILD_REAL_FLOAT
#include "env/backend.h"
#include "env/kernels.h"
#include "env/task/numbers.h"

static int fits_none(const EngineTree *tree) {
    (void)tree;
    return 0;
}

/* The Go1: 12 joints, four feet of a corner each. Its M has the base's 21 entries and four legs of
 * rows of 7, 8 and 9. */
static int fits_go1(const EngineTree *tree) {
    return tree->joints == 12 && tree->feet == 4 && tree->corners == 4 &&
           tree->entries == 21 + 4 * (7 + 8 + 9) && tree->chain == 9;
}

static int any_fits;

static int fits_any(const EngineTree *tree) {
    (void)tree;
    return any_fits;
}

static const EnvsKernels none = {.fixed = 1, .fits = fits_none};
static const EnvsKernels go1 = {.fixed = 1, .fits = fits_go1};
static const EnvsKernels any = {.fixed = 0, .fits = fits_any};

const EnvsKernels *const envs_kernels[] = {&none, &go1, &any, NULL};

static void is_slow(const char *folder, int wanted) {
    Robot *robot = kit_robot(folder);
    assert_int_equal(envs_are_slow(robot), wanted);
    robot_destroy(robot);
}

TEST(robots_of_another_size_are_slow) {
    any_fits = 1;
    is_slow(MILD_SOURCE_DIR "/robots/go1", 0);
    is_slow(MILD_SOURCE_DIR "/robots/sa01", 1);
    any_fits = 0; /* nothing steps it: envs_create says so */
    is_slow(MILD_SOURCE_DIR "/robots/sa01", 0);
}

/* Numbers and their bits by the tables of IEEE 754-2008 binary16; ties go to even. */
TEST(known_frames) {
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

TEST(rounded_frames) {
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
