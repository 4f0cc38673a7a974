/* Mixed ground: its tiles against the formulas of each relief, and the rules that hold for all. */
#include "map_kit.h"

enum { TILES = MILD_MAP_TILES, SEEDS = 12 };

static const double size = 15.0, edge = 3.0, cell = 0.05, wavelength = 0.6;
static const double amplitude = 0.08, slope = 0.3;

static MildMapDef mixed(uint64_t seed) {
    MildMapDef def = shape(MILD_MAP_MIXED, amplitude, wavelength);
    def.size = size;
    def.cell = cell;
    def.slope = slope;
    def.seed = seed;
    return def;
}

typedef enum { LEVEL, UP, DOWN, WAVES, STEPS, ROUGH, RELIEFS } Relief;

/* [m] Distance of a point to the nearest edge of its tile. */
static double to_edge(double x, double y) {
    const double u = fabs(x / edge - round(x / edge)), v = fabs(y / edge - round(y / edge));
    return edge * fmin(u, v);
}

/* Height that a tile of a relief and share 1 would have. Rough ground is that of the kind rough,
 * whose heights test_map.c tests. */
static double expected(Relief relief, const MildTerrain *rough, double x, double y) {
    const double k = 2.0 * acos(-1.0) / wavelength, d = to_edge(x, y);
    const double t = fmin(d / 0.5, 1.0), fade = 3.0 * t * t - 2.0 * t * t * t;
    const double phase = x / wavelength - floor(x / wavelength);
    switch (relief) {
    case UP: return slope * d;
    case DOWN: return -slope * d;
    case WAVES: return fade * amplitude * (sin(k * x) + sin(k * y)) / 2.0;
    case STEPS: return phase > 0.25 && phase < 0.75 ? fade * amplitude : 0.0;
    case ROUGH: return fade * mild_terrain_height_at(rough, x, y);
    default: return 0.0;
    }
}

/* Bool: steps have a riser so near that rounding decides. */
static int at_riser(double x) {
    const double halves = 2.0 * x / wavelength - 0.5;
    return fabs(halves - round(halves)) < 1e-6;
}

/* Share of a relief in a tile, from its grid points by least squares, and how far it is off. */
static double fit(const MildTerrain *terrain, const MildTerrain *rough, Relief relief,
                  const double corner[2], double *off) {
    double product = 0.0, square = 0.0, share = 0.0;
    for (int pass = 0; pass < 2; pass++) {
        *off = 0.0;
        for (double u = 0.0; u < edge - cell / 2; u += cell) {
            for (double v = 0.0; v < edge - cell / 2; v += cell) {
                const double x = corner[0] + u, y = corner[1] + v;
                const double height = mild_terrain_height_at(terrain, x, y);
                const double unit = expected(relief, rough, x, y);
                if (relief != STEPS || !at_riser(x)) {
                    product += height * unit, square += unit * unit;
                    *off = fmax(*off, fabs(height - share * unit));
                }
            }
        }
        share = square > 0.0 ? product / square : 0.0;
    }
    return share;
}

/* The relief that fits a tile within rounding, and its share. */
static Relief relief_of(const MildTerrain *terrain, const MildTerrain *rough,
                        const double corner[2], double *share) {
    int found = RELIEFS;
    for (int relief = LEVEL; relief < RELIEFS; relief++) {
        double off;
        const double fitted = fit(terrain, rough, (Relief)relief, corner, &off);
        if (off < 1e-7 && fitted >= 0.0) {
            assert_int_equal(found, RELIEFS); /* only one fits */
            found = relief, *share = fitted;
            if (relief == LEVEL) {
                break; /* any relief with share 0 fits, too */
            }
        }
    }
    assert_true(found < RELIEFS);
    return (Relief)found;
}

/* Every tile is one of the reliefs at all its grid points. Of 300 tiles a quarter are level and
 * 3/16 each of the others, within three standard deviations (22 and 20); half of the pyramids
 * go up. Shares are uniform in [1/4, 1]: 225 have a mean of 0.625 within three times 0.0144. With
 * the next seed 81 % of the tiles have another relief, and all another share. */
TEST(test_tiles) {
    int count[RELIEFS] = {0};
    Relief last[TILES * TILES] = {LEVEL};
    double last_share[TILES * TILES] = {0};
    int others = 0;
    double least = 1.0, most = 0.0, sum = 0.0;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        MildMapDef def = mixed(seed), plain = def;
        plain.kind = MILD_MAP_ROUGH;
        MildMap *map = make_map(&def), *rough_map = make_map(&plain);
        MildTerrain terrain = terrain_on(map, 0.0), rough = terrain_on(rough_map, 0.0);
        for (int tile = 0; tile < TILES * TILES; tile++) {
            const double corner[2] = {tile % TILES * edge, tile / TILES * edge};
            double share = 0.0;
            const Relief relief = relief_of(&terrain, &rough, corner, &share);
            count[relief]++;
            others += seed > 1 && relief != last[tile];
            last[tile] = relief;
            if (relief != LEVEL) {
                assert_true(fabs(share - last_share[tile]) > 1e-5);
                last_share[tile] = share;
                least = fmin(least, share), most = fmax(most, share), sum += share;
            }
        }
        mild_map_destroy(map);
        mild_map_destroy(rough_map);
    }
    const double mean = sum / (SEEDS * TILES * TILES - count[LEVEL]);
    assert_true(abs(count[LEVEL] - 75) <= 22 && abs(count[UP] + count[DOWN] - 56) <= 20);
    assert_true(abs(count[WAVES] - 56) <= 20 && abs(count[STEPS] - 56) <= 20);
    assert_true(abs(count[ROUGH] - 56) <= 20 && abs(count[UP] - count[DOWN]) <= 22);
    assert_true(least > 0.25 - 1e-6 && least < 0.28 && most > 0.97 && most < 1.0 + 1e-6);
    assert_true(fabs(mean - 0.625) < 0.043);
    assert_true(others > (SEEDS - 1) * TILES * TILES * 7 / 10);
}

/* The height is 0 along all edges of tiles, and does not jump across them: beside an edge it is at
 * most that of a pyramid or of what fades. */
TEST(test_edges) {
    uint64_t random = 44;
    double on = 0.0, beside = 0.0, repeat = 0.0;
    for (uint64_t seed = 1; seed <= SEEDS; seed++) {
        MildMapDef def = mixed(seed);
        MildMap *map = make_map(&def);
        MildTerrain terrain = terrain_on(map, 0.0);
        for (int n = 0; n < 4000; n++) {
            const double a = kit_uniform(&random, -20.0, 20.0);
            const double b = edge * (kit_index(&random, 21) - 10.0);
            const double small = kit_uniform(&random, -1e-6, 1e-6);
            const int turned = n % 2;
            on = fmax(on, fabs(mild_terrain_height_at(&terrain, turned ? b : a, turned ? a : b)));
            const double c = b + small;
            beside = fmax(beside,
                          fabs(mild_terrain_height_at(&terrain, turned ? c : a, turned ? a : c)));
            const double y = kit_uniform(&random, -20.0, 20.0);
            repeat = fmax(repeat, fabs(mild_terrain_height_at(&terrain, a, y) -
                                       mild_terrain_height_at(&terrain, a + size, y - 2 * size)));
        }
        mild_map_destroy(map);
    }
    expect_below("on an edge [m]", on, 1e-12);
    expect_below("within 1e-6 m of it [m]", beside, slope * 1e-6 + 1e-12);
    expect_below("a period on [m]", repeat, 1e-9);
}

/* Where no whole number of cells fits in a tile they are made smaller, and edges stay at 0. Tiles
 * of 2 m are the smallest. */
TEST(test_odd_sizes) {
    static const double sizes[4] = {10.0, 11.0, 17.3, 40.0}, cells[4] = {0.07, 0.3, 0.11, 0.04};
    uint64_t random = 46;
    for (int n = 0; n < 4; n++) {
        MildMapDef def = mixed(3);
        def.size = sizes[n], def.cell = cells[n];
        MildMap *map = make_map(&def);
        MildTerrain terrain = terrain_on(map, 0.0);
        const double tile = sizes[n] / TILES, least = 4.0 * pow(sizes[n] / cells[n], 2);
        assert_true((double)mild_map_bytes(map) > least);
        for (int k = 0; k < 2000; k++) {
            const double at = kit_uniform(&random, -50.0, 50.0), on = tile * (k % 13 - 6);
            assert_true(fabs(mild_terrain_height_at(&terrain, at, on)) < 1e-12);
            assert_true(fabs(mild_terrain_height_at(&terrain, on, at)) < 1e-12);
        }
        mild_map_destroy(map);
    }
}

TEST_MAIN(NULL, NULL)
