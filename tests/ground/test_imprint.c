/* The cache of imprints by itself: against a plain array of cells, what it keeps when it is full,
 * and the ends of its range. */
#include "ground_kit.h"

#include "ground/imprint.h"

#define CELL 0.01  /* [m] edge of a cell */
#define PITCH 0.02 /* [m] edge of an element: two cells */

static Imprints imprints_open(int tiles) {
    ImprintKey *keys = malloc(imprints_bytes(tiles));
    assert_non_null(keys);
    Imprints imprints = {keys, (uint16_t *)(keys + tiles), tiles, 1.0 / CELL, 1};
    imprints_clear(&imprints);
    return imprints;
}

static const double level[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/* Presses the cells of one element in its middle: 3 x 3 points 6.7 mm apart. */
static void press(const Imprints *imprints, double x, double y, double depth) {
    const ImprintElement element = {x, y, PITCH, level};
    imprints_press(imprints, &element, depth);
}

/* Random presses, turned any way, over 2 x 4 tiles about the origin, which one set can hold: every
 * cell is as deep as the deepest of the 9 points of any element that fell into it, rounded to 10
 * um. An element reads the mean of its 9 points. */
static void test_against_an_array(void **state) {
    (void)state;
    enum { COLUMNS = 16, ROWS = 32 };
    static double deepest[COLUMNS][ROWS];
    Imprints imprints = imprints_open(8);
    uint64_t random = 3;
    double worst = 0.0, mean = 0.0;
    for (int n = 0; n < 3000; n++) {
        const double angle = kit_uniform(&random, -3.2, 3.2), c = cos(angle), s = sin(angle);
        const double turned[9] = {c, -s, 0, s, c, 0, 0, 0, 1};
        const ImprintElement element = {kit_uniform(&random, -0.07, 0.07),
                                        kit_uniform(&random, -0.15, 0.15), PITCH, turned};
        const double depth = kit_uniform(&random, 0.0, 0.05);
        double sum = 0.0;
        imprints.time++;
        imprints_press(&imprints, &element, depth);
        for (int k = 0; k < 9; k++) {
            const double a = (k % 3 - 1) * PITCH / 3, b = (k / 3 - 1) * PITCH / 3;
            const int i = (int)floor((element.x + c * a - s * b) / CELL) + COLUMNS / 2;
            const int j = (int)floor((element.y + s * a + c * b) / CELL) + ROWS / 2;
            deepest[i][j] = fmax(deepest[i][j], depth);
        }
        for (int k = 0; k < 9; k++) {
            const double a = (k % 3 - 1) * PITCH / 3, b = (k / 3 - 1) * PITCH / 3;
            const int i = (int)floor((element.x + c * a - s * b) / CELL) + COLUMNS / 2;
            const int j = (int)floor((element.y + s * a + c * b) / CELL) + ROWS / 2;
            sum += deepest[i][j] / 9;
        }
        mean = fmax(mean, fabs(imprints_read(&imprints, &element) - sum));
    }
    for (int i = 0; i < COLUMNS; i++) {
        for (int j = 0; j < ROWS; j++) {
            const double x = (i - COLUMNS / 2 + 0.5) * CELL, y = (j - ROWS / 2 + 0.5) * CELL;
            worst = fmax(worst, fabs(imprints_depth(&imprints, x, y) - deepest[i][j]));
        }
    }
    print_message("imprints against an array: cells off by %.1e m, elements by %.1e m\n", worst,
                  mean);
    assert_true(worst > 0.0 && worst <= 0.5e-5 + 1e-12 && mean <= 0.5e-5 + 1e-12);
    imprints_clear(&imprints);
    assert_true(imprints_depth(&imprints, 0.0, 0.0) == 0.0);
    free(imprints.keys);
}

/* Eight tiles are a set. A ninth takes the place of the one that was changed longest ago. */
static void test_the_oldest_goes(void **state) {
    (void)state;
    Imprints imprints = imprints_open(8);
    const double edge = IMPRINT_EDGE * CELL;
    for (int n = 0; n < 8; n++, imprints.time++) {
        press(&imprints, (n + 0.5) * edge, 0.5 * edge, 1e-3 * (n + 1));
    }
    press(&imprints, 0.5 * edge, 0.5 * edge, 1e-4); /* the first is changed again, not deeper */
    imprints.time++;
    press(&imprints, 0.5 * edge, 1.5 * edge, 0.02);
    for (int n = 0; n < 8; n++) {
        const double depth = imprints_depth(&imprints, (n + 0.5) * edge, 0.5 * edge);
        assert_true(fabs(depth - (n == 1 ? 0.0 : 1e-3 * (n + 1))) < 1e-9);
    }
    assert_true(fabs(imprints_depth(&imprints, 0.5 * edge, 1.5 * edge) - 0.02) < 1e-9);
    /* the new tile begins untouched but for its cells */
    assert_true(imprints_depth(&imprints, 0.9 * edge, 1.9 * edge) == 0.0);
    free(imprints.keys);
}

/* Several sets hold more: of 40 tiles in 128 none is lost when no set gets more than eight. */
static void test_sets(void **state) {
    (void)state;
    Imprints imprints = imprints_open(128);
    const double edge = IMPRINT_EDGE * CELL;
    int kept = 0;
    for (int n = 0; n < 40; n++) {
        press(&imprints, (n % 8 - 3.5) * edge, (n / 8 - 1.5) * edge, 1e-3 * (n + 1));
    }
    for (int n = 0; n < 40; n++) {
        const double depth = imprints_depth(&imprints, (n % 8 - 3.5) * edge, (n / 8 - 1.5) * edge);
        kept += fabs(depth - 1e-3 * (n + 1)) < 1e-9;
    }
    print_message("128 tiles keep %d of 40\n", kept);
    assert_int_equal(kept, 40);
    free(imprints.keys);
}

static void test_ends_of_the_range(void **state) {
    (void)state;
    Imprints imprints = imprints_open(8);
    static const double depth[7] = {4e-6, 6e-6, 0.0123456, 0.65535, 0.7, INFINITY, NAN},
                        kept[7] = {0.0, 1e-5, 0.01235, 0.65535, 0.65535, 0.65535, 0.0};
    for (int k = 0; k < 7; k++) {
        imprints_clear(&imprints);
        press(&imprints, 0.055, 0.055, depth[k]);
        assert_true(fabs(imprints_depth(&imprints, 0.055, 0.055) - kept[k]) < 1e-9);
    }
    const ImprintElement element = {0.055, 0.055, CELL,
                                    (const double[9]){1, 0, 0, 0, 1, 0, 0, 0, 1}};
    for (int k = 0; k < 3; k++) { /* filled: deeper and shallower, and up to the surface */
        imprints_fill(&imprints, &element, 0.02 * ((k + 1) % 3));
        assert_true(fabs(imprints_depth(&imprints, 0.055, 0.055) - 0.02 * ((k + 1) % 3)) < 1e-9);
    }
    imprints_clear(&imprints); /* the world repeats after 65536 tiles */
    press(&imprints, 0.055, -0.055, 0.03);
    const double around = 65536.0 * IMPRINT_EDGE * CELL;
    assert_true(fabs(imprints_depth(&imprints, 0.055 + around, -0.055 - around) - 0.03) < 1e-9);
    assert_true(imprints_depth(&imprints, 0.055 + around / 2, -0.055) == 0.0);
    press(&imprints, 0.055, 0.055, 0.03); /* in the tile at the origin, behind the other */
    memset(imprints.depths, 0x11, 8 * IMPRINT_EDGE * IMPRINT_EDGE * sizeof *imprints.depths);
    static const double far[4] = {1e8, -1e12, INFINITY, NAN}; /* nothing is remembered there */
    for (int k = 0; k < 4; k++) {
        const ImprintElement element = {far[k], 0.0, PITCH, level};
        const ImprintElement other = {0.0, far[k], PITCH, level};
        press(&imprints, far[k], 0.0, 0.02);
        press(&imprints, 0.0, far[k], 0.02);
        assert_true(imprints_read(&imprints, &element) == 0.0);
        assert_true(imprints_read(&imprints, &other) == 0.0);
        assert_true(imprints_depth(&imprints, 0.0, far[k]) == 0.0);
    }
    free(imprints.keys);
}

static void test_sizes(void **state) {
    (void)state;
    static const int tiles[6] = {-1, 0, 1, 8, 9, 100}, whole[6] = {0, 0, 8, 8, 16, 64};
    for (int k = 0; k < 6; k++) {
        assert_int_equal(imprints_round(tiles[k], 64), whole[k]);
    }
    assert_int_equal(imprints_bytes(8), 8 * (8 + 64 * 2)); /* place and time; 64 cells of 2 bytes */
    const Imprints none = {.inverse_cell = 1.0 / CELL};
    assert_true(imprints_depth(&none, 0.0, 0.0) == 0.0);
    assert_true(imprints_same_cell(&none, 0.011, 0.021, 0.019, 0.029));
    assert_false(imprints_same_cell(&none, 0.011, 0.021, 0.021, 0.021));
    assert_false(imprints_same_cell(&none, 0.011, 0.001, 0.011, -0.001));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_against_an_array), cmocka_unit_test(test_the_oldest_goes),
        cmocka_unit_test(test_sets), cmocka_unit_test(test_ends_of_the_range),
        cmocka_unit_test(test_sizes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
