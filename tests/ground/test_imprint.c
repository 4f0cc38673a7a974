/* What ground with imprints remembers, by the public interface alone: an element of two by two
 * cells that nothing can move is set down and taken away. Against a plain array of cells, what is
 * kept when the memory is full, and the ends of its range. */
#include "ground_kit.h"

#define CELL 0.01         /* [m] edge of a cell */
#define PITCH 0.02        /* [m] edge of the element: two cells */
#define EDGE (8.0 * CELL) /* [m] edge of a tile */
#define TRAVEL 1e-4       /* [m] elastic travel of plastic ground */

typedef struct {
    MildSole *sole;
    MildScratch *scratch;
    MildGround *ground;
    MildTerrain terrain;
    MildContactInput input;
    MildContactResult result;
    double A[36]; /* 0 */
} Stamp;

static void stamp_open(Stamp *stamp, int tiles) {
    static const double outline[8] = {-0.01, -0.01, 0.01, -0.01, 0.01, 0.01, -0.01, 0.01};
    const MildSoleDef def = {.outline = outline, .points = 4, .pitch = PITCH};
    MildMaterial sand = mild_material_default();
    sand.recovery = 0.0;
    sand.bed_depth = 1.0;
    *stamp = (Stamp){.terrain = mild_terrain_uniform(&sand)};
    stamp->sole = mild_sole_create(&def, NULL);
    assert_non_null(stamp->sole);
    const MildSole *const soles[] = {stamp->sole};
    stamp->scratch = mild_scratch_create(soles, 1, NULL);
    stamp->ground = mild_ground_init_imprints(
        aligned_alloc(64, mild_ground_bytes_imprints(soles, 1, tiles)), soles, 1, tiles);
    assert_true(stamp->scratch && stamp->ground);
    assert_int_equal(mild_sole_elements(stamp->sole), 1);
}

static void stamp_close(Stamp *stamp) {
    free(stamp->ground);
    mild_scratch_destroy(stamp->scratch);
    mild_sole_destroy(stamp->sole);
}

/* A step in which the element is at a depth, turned by an angle about the vertical, and moves along
 * x and y. */
static void stamp_move(Stamp *stamp, double x, double y, double angle, double depth, double vx,
                       double vy) {
    const double c = cos(angle), s = sin(angle);
    stamp->input = (MildContactInput){.feet = 1,
                                      .dt = 1e-3,
                                      .position = {{x, y, -depth}},
                                      .rotation = {{c, -s, 0, s, c, 0, 0, 0, 1}},
                                      .velocity = {{vx, vy}},
                                      .free_velocity = {vx, vy},
                                      .inverse_inertia = stamp->A};
    mild_ground_solve(stamp->ground, &stamp->terrain, &stamp->input, stamp->scratch,
                      &stamp->result);
    mild_ground_advance(stamp->ground, &stamp->terrain, &stamp->input, stamp->scratch,
                        &stamp->result);
}

static void stamp_stand(Stamp *stamp, double x, double y, double angle, double depth) {
    stamp_move(stamp, x, y, angle, depth, 0.0, 0.0);
}

/* Down to a depth and out again. */
static void stamp_press(Stamp *stamp, double x, double y, double angle, double depth) {
    stamp_stand(stamp, x, y, angle, depth);
    stamp_stand(stamp, x, y, angle, -5e-4);
}

static double stamp_at(const Stamp *stamp, double x, double y) {
    return mild_ground_imprint_at(stamp->ground, x, y);
}

enum { COLUMNS = 16, ROWS = 32 };
/* The array, with its origin in the middle. */
static double deepest[COLUMNS][ROWS];

/* The cell below point k of the element: 3 x 3 points a third of the pitch apart. */
static double *sample(double x, double y, double angle, int k) {
    const double a = (k % 3 - 1) * PITCH / 3, b = (k / 3 - 1) * PITCH / 3;
    const double c = cos(angle), s = sin(angle);
    const int i = (int)floor((x + c * a - s * b) / CELL) + COLUMNS / 2;
    const int j = (int)floor((y + s * a + c * b) / CELL) + ROWS / 2;
    return &deepest[i][j];
}

/* Random presses, turned any way, over 2 x 4 tiles about the origin, which one set can hold. An
 * element that comes down finds the mean of the cells below its 9 points, and does nothing above
 * that. Deeper, it makes each of these cells as deep as itself. Cells are rounded to 10 um. */
TEST(test_against_an_array) {
    Stamp stamp;
    stamp_open(&stamp, 8);
    const size_t bytes = mild_ground_size(stamp.ground);
    void *saved = malloc(bytes);
    uint64_t random = 3;
    double worst = 0.0, mean = 0.0;
    int lasting = 0;
    for (int n = 0; n < 3000; n++) {
        const double angle = kit_uniform(&random, -3.2, 3.2);
        const double x = kit_uniform(&random, -0.07, 0.07), y = kit_uniform(&random, -0.15, 0.15);
        const double depth = kit_uniform(&random, 0.0, 0.05);
        double found = 0.0;
        for (int k = 0; k < 9; k++) {
            found += *sample(x, y, angle, k) / 9;
        }
        if (found >
            TRAVEL) { /* on the unloading line of what it finds; then as if it had not been */
            memcpy(saved, stamp.ground, bytes);
            stamp_stand(&stamp, x, y, angle, found - TRAVEL / 2);
            mean = fmax(mean, fabs(mild_ground_depth_max(stamp.ground, 0)[0] - found));
            assert_int_equal(mild_ground_restore(stamp.ground, saved, bytes, NULL), MILD_OK);
        }
        if (fabs(depth - found) < 2 * TRAVEL) {
            continue; /* what it leaves there depends on the rounding */
        }
        stamp_press(&stamp, x, y, angle, depth);
        for (int k = 0; k < 9 && depth > found; k++) {
            double *cell = sample(x, y, angle, k);
            *cell = fmax(*cell, depth);
        }
        lasting += depth > found;
    }
    for (int i = 0; i < COLUMNS; i++) {
        for (int j = 0; j < ROWS; j++) {
            const double x = (i - COLUMNS / 2 + 0.5) * CELL, y = (j - ROWS / 2 + 0.5) * CELL;
            worst = fmax(worst, fabs(stamp_at(&stamp, x, y) - deepest[i][j]));
        }
    }
    assert_true(lasting > 200);
    assert_true(worst > 0.0 && worst <= 0.5e-5 + 1e-12);
    assert_true(mean > 0.0 && mean <= 0.5e-5 + 1e-12);
    mild_ground_reset(stamp.ground);
    assert_true(stamp_at(&stamp, 0.0, 0.0) == 0.0);
    free(saved);
    stamp_close(&stamp);
}

/* Several sets hold more: of 40 tiles in 128 none is lost when no set gets more than eight. */
TEST(test_sets) {
    Stamp stamp;
    stamp_open(&stamp, 128);
    int kept = 0;
    for (int n = 0; n < 40; n++) {
        stamp_press(&stamp, (n % 8 - 3.5) * EDGE, (n / 8 - 1.5) * EDGE, 0.0, 1e-3 * (n + 1));
    }
    for (int n = 0; n < 40; n++) {
        const double depth = stamp_at(&stamp, (n % 8 - 3.5) * EDGE, (n / 8 - 1.5) * EDGE);
        kept += fabs(depth - 1e-3 * (n + 1)) < 1e-9;
    }
    assert_int_equal(kept, 40);
    stamp_close(&stamp);
}

TEST(test_ends_of_the_range) {
    Stamp stamp;
    stamp_open(&stamp, 8);
    static const double depth[5] = {4e-6, 6e-6, 0.0123456, 0.65535, 0.7},
                        kept[5] = {0.0, 1e-5, 0.01235, 0.65535, 0.65535};
    for (int k = 0; k < 5; k++) {
        mild_ground_reset(stamp.ground);
        stamp_press(&stamp, 0.055, 0.055, 0.0, depth[k]);
        assert_true(fabs(stamp_at(&stamp, 0.055, 0.055) - kept[k]) < 1e-9);
    }
    mild_ground_reset(stamp.ground); /* the world repeats after 65536 tiles */
    stamp_press(&stamp, 0.055, -0.055, 0.0, 0.03);
    const double around = 65536.0 * EDGE;
    assert_true(fabs(stamp_at(&stamp, 0.055 + around, -0.055 - around) - 0.03) < 1e-9);
    assert_true(stamp_at(&stamp, 0.055 + around / 2, -0.055) == 0.0);
    stamp_press(&stamp, 0.0, 0.0, 0.0, 0.03); /* in four tiles, the last of them at the origin */
    stamp_press(&stamp, -0.005, 0.075, 0.0, 0.03); /* in the last cell of the one before it */
    static const double far[4] = {1e8, -1e12, INFINITY, NAN}; /* nothing is remembered there */
    for (int k = 0; k < 4; k++) {
        stamp_press(&stamp, far[k], 0.0, 0.0, 0.04);
        stamp_press(&stamp, 0.0, far[k], 0.0, 0.04);
        assert_true(stamp_at(&stamp, 0.0, far[k]) == 0.0);
        assert_true(stamp_at(&stamp, far[k], 0.0) == 0.0);
        stamp_stand(&stamp, far[k], 0.0, 0.0, 0.01);        /* nor found */
        const double stood = isfinite(far[k]) ? 0.01 : 0.0; /* no step where there is no place */
        assert_true(mild_ground_depth_max(stamp.ground, 0)[0] == stood);
        stamp_stand(&stamp, far[k], 0.0, 0.0, -5e-4);
    }
    assert_true(fabs(stamp_at(&stamp, 0.0, 0.0) - 0.03) < 1e-9);
    assert_true(fabs(stamp_at(&stamp, -0.005, 0.075) - 0.03) < 1e-9);
    stamp_close(&stamp);
}

/* Where the ground flows back an imprint may become shallower, up to the surface. */
TEST(test_fill) {
    static const double share[4] = {0.5, 0.5, 0.9, 1.0}, depth[4] = {0.04, 0.03, 0.05, 0.01};
    Stamp stamp;
    stamp_open(&stamp, 8);
    for (int k = 0; k < 4; k++) {
        stamp.terrain.materials[0].refill = share[k];
        stamp_press(&stamp, 0.055, 0.055, 0.0, depth[k]);
        assert_true(fabs(stamp_at(&stamp, 0.055, 0.055) - (1.0 - share[k]) * depth[k]) < 1e-9);
    }
    stamp_close(&stamp);
}

/* An element that slides leaves an imprint in each cell that it slides out of, and none while it
 * stays in one. */
TEST(test_slides) {
    static const double way[4][2] = {{0.004, 0.004}, {0.006, 0.0}, {0.0, 0.006}, {0.0, -0.007}};
    Stamp stamp;
    stamp_open(&stamp, 8);
    for (int k = 0; k < 4; k++) {
        mild_ground_reset(stamp.ground);
        const double y = k == 3 ? 0.005 : 0.055;
        stamp_move(&stamp, 0.055, y, 0.0, 0.02, 1e3 * way[k][0], 1e3 * way[k][1]);
        assert_true(fabs(stamp_at(&stamp, 0.055, y) - (k ? 0.02 : 0.0)) < 1e-9);
    }
    stamp_close(&stamp);
}

/* Tiles come in sets of eight, of 8 bytes for place and time and 64 cells of 2 bytes. */
TEST(test_sizes) {
    static const int tiles[5] = {-1, 0, 1, 8, 9}, whole[5] = {0, 0, 8, 8, 16};
    Stamp stamp;
    stamp_open(&stamp, 0);
    const MildSole *const soles[] = {stamp.sole};
    const size_t without = mild_ground_bytes(soles, 1);
    for (int k = 0; k < 5; k++) {
        assert_int_equal(mild_ground_bytes_imprints(soles, 1, tiles[k]) - without,
                         whole[k] * (8 + 64 * 2));
    }
    assert_int_equal(mild_ground_bytes_imprints(soles, 1, MILD_IMPRINT_TILES_MAX + 1) - without,
                     MILD_IMPRINT_TILES_MAX * (8 + 64 * 2));
    assert_true(stamp_at(&stamp, 0.0, 0.0) == 0.0);
    stamp_press(&stamp, 0.0, 0.0, 0.0, 0.02);
    assert_true(stamp_at(&stamp, 0.0, 0.0) == 0.0);
    stamp_close(&stamp);
}

TEST_MAIN(NULL, NULL)
