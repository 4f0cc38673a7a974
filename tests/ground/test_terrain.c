/* Contact on uneven ground: which elements are found and how deep, friction on a slope, energy. */
#include "surface_kit.h"

/* 6 mm above the ground an element that gets there within the step is found, however it does: by
 * falling, by sliding uphill along either axis, by tilting, by turning uphill. 16 m/s are 8 mm in
 * half a step of 1 ms. */
TEST(test_fast_elements_are_found) {
    enum { EDGE = 5 };
    const double fast = 16.0, x = 2.0 * KIT_PITCH;
    const double motion[5][6] = {
        {0, 0, -fast}, {fast}, {0, fast}, {0, 0, 0, 0, fast / x}, {0, 0, 0, 0, 0, fast / x}};
    static const int uphill[5] = {-1, 0, 1, -1, 1}; /* axis, along which the ground rises by 1 */
    MildSole *plate = kit_plate(5, 1);
    for (int k = 0; k < 5; k++) {
        double heights[EDGE * EDGE];
        for (int i = 0; i < EDGE * EDGE; i++) { /* the first row is that of the greatest y */
            heights[i] = uphill[k] == 0 ? i % EDGE - 2 : uphill[k] == 1 ? 2 - i / EDGE : 0;
        }
        MildMapDef def = shape(MILD_MAP_IMAGE, 0.1, 1.0);
        def.heights = heights, def.height_columns = def.height_rows = EDGE, def.cell = 0.1;
        MildMap *map = make_map(&def);
        const MildMaterial m = mild_material_default();
        for (int moving = 0; moving < 2; moving++) {
            Kit kit;
            kit_open(&kit, 1, plate, NULL, &m, 1e-3);
            kit.terrain = terrain_on(map, 0.0);
            /* uphill along x the element in front is the lowest */
            kit.input.position[0][1] = 0.0;
            kit.input.position[0][2] += 0.006 + (uphill[k] == 0 ? x : 0.0);
            for (int i = 0; i < 6 && moving; i++) {
                kit.input.velocity[0][i] = kit.input.free_velocity[i] = motion[k][i];
            }
            kit_solve(&kit);
            assert_true((kit.result.foot[0].force[2] > 0.0) == moving);
            kit_close(&kit);
        }
        mild_map_destroy(map);
    }
    mild_sole_destroy(plate);
}

/* Depths of the elements are those below the terrain's surface, whatever the elements remember: a
 * foot that slides over waves, whole and in part in the ground. */
TEST(test_depths) {
    MildMapDef def = shape(MILD_MAP_WAVES, 0.03, 0.5);
    MildMap *map = make_map(&def);
    MildSole *sole = kit_sole(0, 77);
    const MildMaterial m = mild_material_default();
    double worst = 0.0;
    int whole = 0, part = 0;
    for (int deep = 0; deep < 2; deep++) {
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &m, 5e-3);
        kit.terrain = terrain_on(map, 0.0);
        kit.input.position[0][2] += deep ? -0.03 : 0.015;
        kit.input.velocity[0][0] = kit.input.free_velocity[0] = 0.6;
        for (int s = 0; s < 300; s++) {
            kit_solve(&kit);
            const MildElements elements = mild_scratch_elements(kit.scratch, 0);
            int under = 0;
            for (int e = 0; e < 77; e++) {
                const double surface =
                    mild_terrain_height_at(&kit.terrain, elements.point_x[e], elements.point_y[e]);
                const double z = kit.input.position[0][2] + KIT_SOLE_Z;
                worst = fmax(worst, fabs(elements.depth[e] - (surface - z)));
                under += surface > z;
            }
            whole += under == 77;
            part += under > 0 && under < 77;
            kit_advance(&kit);
        }
        kit_close(&kit);
    }
    expect_below("depths on waves [m]", worst, 1e-12);
    assert_true(whole > 50 && part > 50); /* steps with all elements in the ground, with some */
    mild_sole_destroy(sole);
    mild_map_destroy(map);
}

/* ---- contact ---- */

/* A plate on a slope. It slides exactly when slope > mu; then, forced to follow z = slope x and
 * with F_x = (mu - slope) F_z, it accelerates with a_x = (mu - slope) g/(1 - slope (mu - slope)).
 */
TEST(test_slope_friction) {
    MildSole *sole = kit_plate(6, 6);
    MildMaterial m = kit_preset("rubber");
    m.k_drift = m.b_drift = 0.0;
    double worst = 0.0, creep = 0.0;
    for (int t = 0; t < 8; t++) {
        double slope = 0.1 + 0.1 * (t / 2), mu = slope + (t % 2 ? 0.05 : -0.07);
        MildMapDef def = shape(MILD_MAP_SLOPE, 0.0, 1.0);
        def.slope = slope;
        MildMap *map = make_map(&def);
        Kit kit;
        m.mu = mu;
        kit_open(&kit, 1, sole, NULL, &m, 1e-3);
        kit.terrain.map = map;
        kit.inertia[0] = 1e9; /* it stays level and only slides */
        kit.input.position[0][0] = kit.input.position[0][1] = 0.0;
        for (int s = 0; s < 500; s++) { /* brought to rest on the slope by hand */
            kit_step(&kit, NULL);
            for (int k = 0; k < 6; k++) {
                kit.input.velocity[0][k] *= 0.9;
            }
        }
        double from = kit.input.position[0][0], speed = kit.input.velocity[0][0];
        for (int s = 0; s < 300; s++) {
            kit_step(&kit, NULL);
        }
        double a = (kit.input.velocity[0][0] - speed) / 0.3,
               exact = mu < slope ? (mu - slope) * KIT_GRAVITY / (1.0 - slope * (mu - slope)) : 0.0;
        if (mu < slope) {
            worst = fmax(worst, fabs(a / exact - 1.0));
        } else {
            creep = fmax(creep, fabs(kit.input.position[0][0] - from));
        }
        kit_close(&kit);
        mild_map_destroy(map);
    }
    expect_below("sliding acceleration [-]", worst, 0.02);
    expect_below("creep in 0.3 s [m]", creep, 1e-5);
    mild_sole_destroy(sole);
}

static MildMap *random_map(uint64_t *random) {
    static const MildMapKind kinds[6] = {MILD_MAP_WAVES, MILD_MAP_ROUGH, MILD_MAP_STEPS,
                                         MILD_MAP_SLOPE, MILD_MAP_MIXED, MILD_MAP_BLOCKS};
    MildMapDef def = shape(kinds[kit_index(random, 6)], 0.0, kit_uniform(random, 0.15, 1.0));
    def.seed = (uint64_t)kit_index(random, 1000);
    def.size = def.kind == MILD_MAP_MIXED ? 10.0 : 4.0;
    def.amplitude = kit_uniform(random, 0.0, 0.05) * fmin(1.0, def.wavelength / 0.2);
    def.slope = kit_uniform(random, -0.5, 0.5);
    return make_map(&def);
}

/* Feet thrown and shaken at random over uneven ground. */
TEST(test_passive) {
    uint64_t random = 44;
    MildSole *sole = kit_sole(0, 77);
    static const double steps[3] = {0.25e-3, 1e-3, 5e-3};
    Shaken all = {0};
    for (int draw = 0; draw < kit_draws(600); draw++) {
        const MildMaterial m = kit_material(&random);
        MildMap *map = random_map(&random);
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &m, steps[kit_index(&random, 3)]);
        kit.terrain.map = map;
        kit.terrain.map_x = kit_uniform(&random, -5.0, 5.0);
        kit.terrain.map_y = 1.0; /* not on the edge of a tile, where mixed ground is level */
        kit_random_state(&kit, &random);
        kit.input.position[0][2] +=
            0.25 + mild_terrain_height_at(&kit.terrain, kit.input.position[0][0],
                                          kit.input.position[0][1]);
        kit_shake(&kit, 0.7, &random, draw, &all);
        kit_close(&kit);
        mild_map_destroy(map);
    }
    kit_shaken("uneven ground", &all, kit_draws(300));
    mild_sole_destroy(sole);
}

/* One element led by hand (A = 0) round after round through waves, deep in the troughs and lightly
 * over the crests: where the ground rises faster than its tangent the element must not be loaded
 * for nothing. */
TEST(test_passive_by_hand) {
    uint64_t random = 47;
    MildSole *sole = kit_plate(1, 1);
    double worst = -INFINITY;
    for (int draw = 0; draw < kit_draws(400); draw++) {
        MildMaterial m = kit_material(&random);
        m.c_g = 0.0, m.recovery = draw % 2 ? 1.0 : m.recovery, m.mu = 0.0,
        m.k_drift = m.b_drift = 0.0;
        MildMapDef def =
            shape(MILD_MAP_WAVES, kit_uniform(&random, 0.0, 0.05), kit_uniform(&random, 0.2, 1.0));
        def.cell = 0.005;
        MildMap *map = make_map(&def);
        Kit kit;
        double dt = draw % 3 ? 1e-3 : 5e-3, speed = kit_uniform(&random, 0.1, 1.0),
               deep = kit_uniform(&random, 0.002, 0.04);
        double k = 2.0 * acos(-1.0) / def.wavelength, work = 0.0, taken = 0.0,
               share = kit_uniform(&random, 0.1, 0.9);
        kit_open(&kit, 1, sole, NULL, &m, dt);
        kit.terrain.map = map;
        kit.input.position[0][0] = kit.input.position[0][1] = 0.0;
        for (double t = 0.0; t < 4.0 * def.wavelength / speed; t += dt) {
            double x = kit.input.position[0][0] + speed * dt,
                   u = deep * fmin(1.0, 20.0 * t) * (1.0 - share * sin(k * x));
            double z = mild_terrain_height_at(&kit.terrain, x, 0.0) - u - KIT_SOLE_Z;
            if (t + dt >= 4.0 * def.wavelength / speed) {
                z += 0.2;
            }
            kit.input.velocity[0][0] = kit.input.free_velocity[0] = speed;
            kit.input.velocity[0][2] = kit.input.free_velocity[2] =
                (z - kit.input.position[0][2]) / dt;
            kit_solve(&kit);
            kit_advance(&kit);
            double w = dt * (kit.result.foot[0].force[0] * speed +
                             kit.result.foot[0].force[2] * kit.input.velocity[0][2]);
            work += w;
            taken += fabs(w);
        }
        worst = fmax(worst, work / taken);
        kit_close(&kit);
        mild_map_destroy(map);
    }
    expect_below("share of the work that is given back in excess", worst, 0.0);
    mild_sole_destroy(sole);
}

/* Mixed ground: its tiles against the formulas of each relief, and the rules that hold for all. */

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
