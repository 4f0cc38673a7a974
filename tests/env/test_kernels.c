/* Which kernels of a build a robot takes: the first that fit, and envs_are_slow says when those are
 * for any robot. The table of the build is not linked here, this one stands in its place. */
#include "robots.h"

#define MILD_REAL_FLOAT
#include "env/backend.h"
#include "env/kernels.h"

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

TEST_MAIN(NULL, NULL)
