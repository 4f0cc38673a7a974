/* Height maps and patterns against their formulas. */
#include "surface_kit.h"

#include "ground/terrain/grid.h"
#include "ground/terrain/map_view.h"

/* Waves and steps at random points: at grid points the formula, between them within the error of
 * bilinear interpolation, (2 pi/wavelength)^2 amplitude cell^2/8. */
TEST(test_shapes) {
    uint64_t random = 41;
    const double k = 2.0 * acos(-1.0) / 0.7, amplitude = 0.03;
    MildMapDef def = shape(MILD_MAP_WAVES, amplitude, 0.7);
    MildMap *map = make_map(&def);
    MildTerrain terrain = terrain_on(map, 0.2);
    double cell = 0.7 / 35.0, at_points = 0.0, between = 0.0, slopes = 0.0;
    for (int t = 0; t < 20000; t++) {
        double x = kit_uniform(&random, -20.0, 20.0), y = kit_uniform(&random, -20.0, 20.0),
               slope[2];
        between = fmax(between, fabs(mild_terrain_height_at(&terrain, x, y) - 0.2 -
                                     0.5 * amplitude * (sin(k * x) + sin(k * y))));
        mild_terrain_slope_at(&terrain, x, y, slope);
        slopes = fmax(slopes, fabs(slope[0] - 0.5 * amplitude * k * cos(k * x)));
        x = cell * round(x / cell), y = cell * round(y / cell);
        at_points = fmax(at_points, fabs(mild_terrain_height_at(&terrain, x, y) - 0.2 -
                                         0.5 * amplitude * (sin(k * x) + sin(k * y))));
    }
    double bound = k * k * amplitude * cell * cell / 8.0;
    expect_below("waves at grid points [m]", at_points, 1e-8);
    expect_below("between them [m]", between, bound + 1e-8);
    expect_below("their slope", slopes, k * k * amplitude * cell);
    mild_map_destroy(map);

    def = shape(MILD_MAP_STEPS, 0.05, 0.8);
    map = make_map(&def);
    terrain = terrain_on(map, 0.0);
    for (int t = -8; t < 8; t++) {
        for (double phase = -0.2; phase < 0.2;
             phase += 0.05) { /* clear of the risers at odd quarters */
            assert_true(fabs(mild_terrain_height_at(&terrain, 0.8 * (t + phase), 3.0 * t)) < 1e-8);
            assert_true(fabs(mild_terrain_height_at(&terrain, 0.8 * (t + phase + 0.5), 3.0 * t) -
                             0.05) < 1e-8);
        }
    }
    mild_map_destroy(map);

    def = shape(MILD_MAP_SLOPE, 0.0, 1.0);
    def.slope = -0.3;
    map = make_map(&def);
    terrain = terrain_on(map, 0.1);
    assert_true(mild_terrain_height_at(&terrain, 50.0, 3.0) == 0.1 + -0.3 * 50.0);
    assert_false(mild_map_is_level(map));
    mild_map_destroy(map);

    def = shape(MILD_MAP_FLAT, 0.1, 1.0);
    map = make_map(&def);
    assert_true(mild_map_is_level(map));
    mild_map_destroy(map);
}

/* Blocks of 0.7 m with the origin in the middle of one: each level, at 0, half or all of what |x|
 * of its middle allows; 8 x 8 of them, then again. */
TEST(test_blocks) {
    enum { BLOCKS = 8 };
    static const double away[BLOCKS] = {0.0, 0.7, 1.4, 2.1, 2.8, 2.1, 1.4, 0.7}; /* [m] */
    MildMapDef def = shape(MILD_MAP_BLOCKS, 0.16, 0.7);
    def.size = 5.6;
    for (int bound = 0; bound < 2; bound++) {
        int count[3] = {0};
        def.slope = bound ? 0.1 : 0.0;
        MildMap *map = make_map(&def);
        MildTerrain terrain = terrain_on(map, 0.0);
        for (int n = 0; n < BLOCKS * BLOCKS; n++) {
            const double x = 0.7 * (n % BLOCKS), y = 0.7 * (n / BLOCKS);
            const double most = bound ? fmin(0.16, 0.1 * away[n % BLOCKS]) : 0.16;
            const double height = mild_terrain_height_at(&terrain, x, y);
            const double level = most > 0.0 ? 2.0 * height / most : 0.0;
            assert_true(fabs(level - round(level)) < 1e-6 && height >= 0.0 && level < 2.5);
            count[(int)round(level)] += most > 0.0;
            for (int k = 0; k < 4; k++) { /* near its corners, and a period away */
                const double u = x + (k % 2 ? 0.32 : -0.32), v = y + (k / 2 ? 0.32 : -0.32);
                assert_true(fabs(mild_terrain_height_at(&terrain, u - 5.6, v) - height) < 1e-8);
                assert_true(fabs(mild_terrain_height_at(&terrain, u, v + 5.6) - height) < 1e-8);
            }
            assert_true(height == 0.0 || most > 0.0);
        }
        assert_true(count[0] > 8 && count[1] > 8 && count[2] > 8);
        mild_map_destroy(map);
    }
}

TEST(test_rough) {
    uint64_t random = 42;
    MildMapDef def = shape(MILD_MAP_ROUGH, 0.04, 0.25);
    def.size = 4.0;
    MildMap *map = make_map(&def);
    def.seed = 2;
    MildMap *other = make_map(&def);
    MildTerrain terrain = terrain_on(map, 0.0), second = terrain_on(other, 0.0);
    double least = 1.0, most = -1.0, sum = 0.0, repeat = 0.0, differ = 0.0;
    enum { POINTS = 20000 };
    for (int t = 0; t < POINTS; t++) {
        double x = kit_uniform(&random, -4.0, 4.0), y = kit_uniform(&random, -4.0, 4.0),
               h = mild_terrain_height_at(&terrain, x, y);
        least = fmin(least, h), most = fmax(most, h), sum += h / POINTS;
        repeat = fmax(repeat, fabs(h - mild_terrain_height_at(&terrain, x + 4.0, y - 8.0)));
        differ = fmax(differ, fabs(h - mild_terrain_height_at(&second, x, y)));
    }
    assert_true(least >= -0.04 && most <= 0.04 && most - least > 0.06 && fabs(sum) < 0.005);
    assert_true(repeat < 1e-9 && differ > 0.01);
    mild_map_destroy(map);
    mild_map_destroy(other);
}

/* Rough ground is random at points a wavelength apart, and between them follows 3 t^2 - 2 t^3:
 * 5/32 a quarter on, 1/2 in the middle, along both axes. */
TEST(test_rough_between) {
    static const double share[4] = {0.0, 5.0 / 32.0, 0.5, 27.0 / 32.0};
    MildMapDef def = shape(MILD_MAP_ROUGH, 0.04, 0.25);
    def.size = 2.0;
    def.cell = 0.25 / 4;
    MildMap *map = make_map(&def);
    MildTerrain terrain = terrain_on(map, 0.0);
    double worst = 0.0, alike = 1.0;
    for (int n = 0; n < 64 * 16; n++) {
        const int i = n % 4, j = n / 4 % 4;
        const double x = n / 16 % 8 * 0.25, y = n / 128 * 0.25;
        double corner[4];
        for (int k = 0; k < 4; k++) {
            corner[k] = mild_terrain_height_at(&terrain, x + k % 2 * 0.25, y + k / 2 * 0.25);
        }
        const double low = (1 - share[i]) * corner[0] + share[i] * corner[1];
        const double high = (1 - share[i]) * corner[2] + share[i] * corner[3];
        const double height = mild_terrain_height_at(&terrain, x + i * def.cell, y + j * def.cell);
        worst = fmax(worst, fabs(height - (1 - share[j]) * low - share[j] * high));
        alike = fmin(alike, fabs(corner[0] - corner[1]));
    }
    expect_below("rough between its points [m]", worst, 1e-8);
    assert_true(alike > 1e-5);
    mild_map_destroy(map);
}

static void assert_range(const MildMap *map, double low, double high) {
    double range[2];
    mild_map_range(map, &range[0], &range[1]);
    assert_true(range[0] == low || fabs(range[0] - low) < 1e-8);
    assert_true(range[1] == high || fabs(range[1] - high) < 1e-8);
}

/* Lowest and highest point, the length after which it repeats, and the number of labels. */
TEST(test_measures) {
    MildMapDef def = shape(MILD_MAP_WAVES, 0.03, 0.8); /* 40 cells: the crests are grid points */
    double x, y;
    MildMap *map = make_map(&def);
    assert_range(map, -0.03, 0.03);
    mild_map_extent(map, &x, &y);
    assert_true(fabs(x - 0.8) < 1e-12 && fabs(y - 0.8) < 1e-12);
    assert_int_equal(mild_map_label_count(map), 1);
    mild_map_destroy(map);

    def = shape(MILD_MAP_STEPS, 0.05, 0.8);
    def.patches = MILD_PATTERN_STRIPES, def.patch_count = 5;
    map = make_map(&def);
    assert_range(map, 0.0, 0.05);
    mild_map_extent(map, &x, &y);
    assert_true(fabs(x - 2.5) < 1e-12); /* five stripes of 0.5 m */
    assert_int_equal(mild_map_label_count(map), 5);
    mild_map_destroy(map);

    double heights[12] = {-0.5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.25}; /* in opposite corners */
    def = shape(MILD_MAP_IMAGE, 2.0, 1.0);
    def.heights = heights, def.height_columns = 4, def.height_rows = 3, def.cell = 0.1;
    map = make_map(&def);
    assert_range(map, -1.0, 0.5);
    mild_map_extent(map, &x, &y);
    assert_true(fabs(x - 0.3) < 1e-12 && fabs(y - 0.2) < 1e-12);
    mild_map_destroy(map);

    def = mild_map_def_default();
    map = make_map(&def);
    assert_true(mild_map_is_level(map) && mild_map_label_count(map) == 1);
    assert_range(map, 0.0, 0.0);
    mild_map_destroy(map);
    def.kind = MILD_MAP_SLOPE;
    map = make_map(&def);
    assert_range(map, -INFINITY, INFINITY);
    mild_map_destroy(map);
}

/* A tilted plane as an image: bilinear interpolation gives it exactly (float heights: a relative
 * 6e-8), slopes too; beyond the border its last height goes on. */
TEST(test_plane) {
    enum { COLUMNS = 33, ROWS = 17 };
    uint64_t random = 43;
    static double heights[ROWS * COLUMNS];
    for (int r = 0; r < ROWS; r++) {
        for (int c = 0; c < COLUMNS; c++) {
            heights[r * COLUMNS + c] = 0.01 * c - 0.03 * (ROWS - 1 - r);
        }
    }
    MildMapDef def = shape(MILD_MAP_IMAGE, 2.0, 1.0);
    def.cell = 0.05;
    def.heights = heights;
    def.height_columns = COLUMNS, def.height_rows = ROWS;
    MildMap *map = make_map(&def);
    MildTerrain terrain = terrain_on(map, 0.0);
    terrain.map_x = 3.0, terrain.map_y = -1.0;
    double x0 = 3.0 - 0.8, y0 = -1.0 - 0.4, worst = 0.0, slopes = 0.0;
    for (int t = 0; t < 20000; t++) {
        double x = kit_uniform(&random, x0 - 0.5, x0 + 2.1),
               y = kit_uniform(&random, y0 - 0.5, y0 + 1.3), slope[2];
        double u = fmin(fmax(x - x0, 0.0), 1.6), v = fmin(fmax(y - y0, 0.0), 0.8);
        worst = fmax(worst, fabs(mild_terrain_height_at(&terrain, x, y) - (0.4 * u - 1.2 * v)));
        mild_terrain_slope_at(&terrain, x, y, slope);
        slopes = fmax(slopes, fabs(slope[0] - (x > x0 && x < x0 + 1.6 ? 0.4 : 0.0)));
        slopes = fmax(slopes, fabs(slope[1] + (y > y0 && y < y0 + 0.8 ? 1.2 : 0.0)));
    }
    expect_below("plane [m]", worst, 1e-7);
    expect_below("its slopes", slopes, 3e-6);
    assert_true(isfinite(mild_terrain_height_at(&terrain, 1e300, -1e300)));
    mild_terrain_height_at(&terrain, NAN,
                           INFINITY); /* reads nothing outside the map: the sanitizer watches */
    mild_map_destroy(map);
}

TEST(test_patterns) {
    MildMapDef def = mild_map_def_default();
    def.patches = MILD_PATTERN_STRIPES;
    def.patch_count = 3;
    MildMap *map = make_map(&def);
    MildTerrain terrain = terrain_on(map, 0.0);
    for (int t = -7; t < 8; t++) {
        assert_int_equal(mild_terrain_material_at(&terrain, 0.5 * t + 0.25, 0.3 * t),
                         ((t % 3) + 3) % 3);
        assert_true(mild_terrain_blend_at(&terrain, 0.5 * t + 0.01, 0.0).share == 0.0); /* sharp */
    }
    assert_int_equal(mild_map_label_count(map), 3);
    MildError error;
    assert_int_equal(mild_terrain_add_patch(&terrain, &(MildPatch){0.0, 0.2, -1.0, 1.0, 5}, &error),
                     MILD_OK);
    assert_int_equal(mild_terrain_material_at(&terrain, 0.1, 0.0),
                     5); /* a patch wins over the map */
    terrain.material_count = 2;
    assert_refused(mild_terrain_set_map(&terrain, map, &error), MILD_ERROR_ARGUMENT, &error,
                   "terrain.map label 2");
    mild_map_destroy(map);

    def.patches = MILD_PATTERN_CHECKER;
    def.border = 0.2;
    map = make_map(&def);
    terrain = terrain_on(map, 0.0);
    double worst = 0.0; /* along a line through the middle of fields: the mixture is linear across
                           each border */
    for (double x = -0.249; x < 0.25; x += 0.001) {
        MildBlend blend = mild_terrain_blend_at(&terrain, x, 0.25);
        double right =
            blend.first == 0 ? 1.0 - blend.share : blend.share; /* of material 0, right of x = 0 */
        worst = fmax(worst, fabs(right - fmin(fmax(0.5 + x / 0.2, 0.0), 1.0)));
        assert_int_equal(blend.first, x < 0.0 ? 2 : 0);
    }
    expect_below("share across a border of 0.2 m in cells of 0.02 m", worst, 0.055);
    mild_map_destroy(map);

    const unsigned char labels[6] = {0, 1, 2, 3, 4, 5}; /* two rows, the first at larger y */
    def.border = 0.0;
    def.patches = MILD_PATTERN_IMAGE;
    def.labels = labels, def.label_columns = 3, def.label_rows = 2;
    map = make_map(&def);
    terrain = terrain_on(map, 0.0);
    for (int i = 0; i < 6; i++) {
        assert_int_equal(
            mild_terrain_material_at(&terrain, 0.5 * (i % 3) - 0.5, i < 3 ? 0.25 : -0.25), i);
    }
    assert_int_equal(mild_terrain_material_at(&terrain, 99.0, 99.0), 2);
    mild_map_destroy(map);
}

TEST(test_refused) {
    static const double bad_heights[4] = {0, 0, NAN, 0};
    static const unsigned char labels[1] = {1};
    struct {
        MildMapDef def;
        MildStatus status;
        const char *names;
    } bad[14];
    int count = 0;
#define BAD(member, value, error, named)                                                           \
    bad[count].def = mild_map_def_default(), bad[count].def.member = (value),                      \
    bad[count].status = MILD_ERROR_##error, bad[count++].names = named
    BAD(cell, 0.0, RANGE, "terrain.cell 0");
    BAD(cell, NAN, RANGE, "terrain.cell nan");
    BAD(amplitude, -1.0, RANGE, "terrain.amplitude -1");
    BAD(wavelength, INFINITY, RANGE, "terrain.wavelength inf");
    BAD(slope, 2.0, RANGE, "terrain.slope 2");
    BAD(border, 1.0, RANGE, "terrain.border 1 terrain.patch_size 0.5");
    bad[count - 1].def.patches = MILD_PATTERN_STRIPES;
    BAD(kind, 9, RANGE, "terrain.kind 9");
    BAD(patches, -1, RANGE, "terrain.patches -1");
    BAD(size, 1000.0, RANGE, "terrain.cell");
    bad[count - 1].def.kind = MILD_MAP_ROUGH;
    bad[count - 1].def.cell = 0.001;
    BAD(size, 8.0, RANGE, "terrain.size 8 10");
    bad[count - 1].def.kind = MILD_MAP_MIXED;
    BAD(heights, NULL, ARGUMENT, "terrain.image");
    bad[count - 1].def.kind = MILD_MAP_IMAGE;
    BAD(heights, bad_heights, RANGE, "terrain.image nan row 1 column 0");
    bad[count - 1].def.kind = MILD_MAP_IMAGE;
    bad[count - 1].def.height_columns = bad[count - 1].def.height_rows = 2;
    BAD(labels, labels, ARGUMENT, "terrain.labels");
    bad[count - 1].def.patches = MILD_PATTERN_IMAGE;
    BAD(border, 0.8, RANGE, "terrain.patches terrain.cell terrain.border 0.8");
    MildMapDef wide = mild_map_def_default();
    wide.patches = MILD_PATTERN_STRIPES, wide.patch_size = 1.0;
    wide.cell = 0.002, wide.border = 0.8;
    mild_map_destroy(make_map(&wide)); /* stripes look along x only: less work than a checker */
    bad[count - 1].def = wide;
    bad[count - 1].def.patches = MILD_PATTERN_CHECKER;
    for (int i = 0; i < count; i++) {
        MildError error = {0};
        MildMap *map = mild_map_create(&bad[i].def, &error);
        assert_null(map);
        assert_error(&error, bad[i].status, bad[i].names);
    }
#undef BAD
}

/* number as the nearest float and the rest. Two floats hold 48 bits at the least. */
static void assert_number(MapNumber found, double number) {
    const volatile float nearest = (float)number;
    assert_true(found.high == nearest);
    assert_true(fabs((double)found.high + (double)found.low - number) <= 0x1p-48 * fabs(number));
}

/* A GPU's view of a map has the lengths of the map. */
TEST(test_view) {
    uint64_t random = 3;
    for (int draw = 0; draw < 500; draw++) {
        MildMapDef def = shape(MILD_MAP_WAVES, 0.03, kit_uniform(&random, 0.3, 2.0));
        def.slope = kit_uniform(&random, -0.3, 0.3);
        def.patches = MILD_PATTERN_CHECKER;
        def.patch_size = kit_uniform(&random, 0.3, 3.0);
        def.patch_count = 2;
        MildMap *map = make_map(&def);
        const MapView view = map_view(map);
        assert_number(view.slope, map->slope);
        assert_number(view.x.cell, map->heights.cell_x);
        assert_number(view.x.inverse, 1 / map->heights.cell_x);
        assert_number(view.y.cell, map->heights.cell_y);
        assert_number(view.y.inverse, 1 / map->heights.cell_y);
        assert_number(view.label_x.cell, map->labels.cell_x);
        assert_number(view.label_y.inverse, 1 / map->labels.cell_y);
        mild_map_destroy(map);
    }
}

TEST(test_bytes) {
    MildMapDef waves = shape(MILD_MAP_WAVES, 0.03, 0.8), rough = shape(MILD_MAP_ROUGH, 0.03, 0.4);
    rough.patches = MILD_PATTERN_CHECKER;
    rough.border = 0.1;
    MildMap *small = make_map(&waves), *large = make_map(&rough);
    assert_true(mild_map_bytes(small) < 8000 && mild_map_bytes(large) < 800000 &&
                sizeof(MildTerrain) < 3300);
    mild_map_destroy(small);
    mild_map_destroy(large);
}

TEST_MAIN(NULL, NULL)
