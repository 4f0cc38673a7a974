/* The ground in the scene: tiles that lie on the surface, beside each other, around the feet, and
 * follow what is pressed. */
#include <math.h>

#include "plugin_kit.h"

#define TILES (32 * 32 + 2 * 32 * 32 * 3 / 4) /* three squares, two without their middle */
#define SIDE 5.12                             /* [m] of the largest square */

#define WAVES                                                                                      \
    CONFIG("terrain.kind", "waves")                                                                \
    CONFIG("terrain.amplitude", "0.03") CONFIG("terrain.wavelength", "1") CONFIG("height", "0.2")
#define HFIELD                                                                                     \
    "<asset><hfield name='hills' nrow='2' ncol='2' size='1 1 1 1' elevation='0 0 0 1'/></asset>"

typedef struct {
    mjModel *m;
    mjData *d;
    mjvScene scene;
    mjvOption option;
} Shown;

/* A plate at (x, y) on a ground with these keys. */
static void show_on(Shown *shown, const char *ground, const char *keys, const char *asset,
                    const char *geom, double x, double y) {
    char head[1500], text[3000];
    kit_head(head, sizeof head, 0.002, "Euler", "plate", ground, keys);
    snprintf(text, sizeof text,
             "%s%s<worldbody>%s<body name='plate' pos='%g %g 0.3'><freejoint/><geom type='box' "
             "size='.1 .05 .01' mass='3' contype='0' conaffinity='0'/></body></worldbody></mujoco>",
             head, asset, geom, x, y);
    shown->m = kit_model(text);
    shown->d = mj_makeData(shown->m);
    mj_forward(shown->m, shown->d);
    mjv_defaultScene(&shown->scene);
    mjv_defaultOption(&shown->option);
    mjv_makeScene(shown->m, &shown->scene, 4000);
}

static void show(Shown *shown, const char *keys, const char *asset, const char *geom, double x,
                 double y) {
    show_on(shown, "sand_loose", keys, asset, geom, x, y);
}

static void update(Shown *shown) {
    mjvCamera camera;
    mjv_defaultCamera(&camera);
    mjv_updateScene(shown->m, shown->d, &shown->option, NULL, &camera, mjCAT_ALL, &shown->scene);
}

static void hide(Shown *shown) {
    mjv_freeScene(&shown->scene);
    mj_deleteData(shown->d);
    mj_deleteModel(shown->m);
}

static int is_tile(const mjvGeom *geom) {
    return geom->category == mjCAT_STATIC && geom->type == mjGEOM_BOX;
}

static int count_tiles(Shown *shown) {
    int count = 0;
    update(shown);
    for (int i = 0; i < shown->scene.ngeom; i++) {
        count += is_tile(&shown->scene.geoms[i]);
    }
    return count;
}

/* [m] The surface of WAVES. */
static double waves(double x, double y) {
    const double k = 6.283185307179586;
    return 0.2 + 0.015 * (sin(k * x) + sin(k * y));
}

/* The top of a tile lies on the surface, and the tile is tilted as the surface is. */
static void check_tile(const mjvGeom *tile) {
    const float *p = tile->pos, *turn = tile->mat;
    const double k = 6.283185307179586;
    const double x = (double)(p[0] + turn[2] * tile->size[2]);
    const double y = (double)(p[1] + turn[5] * tile->size[2]);
    const double z = (double)(p[2] + turn[8] * tile->size[2]);
    const double slope[2] = {0.015 * k * cos(k * x), 0.015 * k * cos(k * y)};
    const double edge = 2 * (double)tile->size[0] * (double)turn[0];
    assert_true(fabs(z - waves(x, y)) < 0.3 * edge * edge); /* the sag of a chord, and of cells */
    assert_true(fabs((double)(turn[2] / turn[8]) + slope[0]) < 0.01);
    assert_true(fabs((double)(turn[5] / turn[8]) + slope[1]) < 0.01);
    for (int k = 0; k < 3; k++) { /* three axes at right angles */
        const float *a = turn + k, *b = turn + (k + 1) % 3;
        assert_true(fabs((double)(a[0] * b[0] + a[3] * b[3] + a[6] * b[6])) < 1e-6);
    }
}

TEST(tiles_lie_on_the_surface) {
    Shown shown;
    double area = 0, low[2] = {1e9, 1e9}, high[2] = {-1e9, -1e9};
    show(&shown, WAVES, "", "", 3.1, -7.4);
    assert_int_equal(count_tiles(&shown), TILES);
    for (int i = 0; i < shown.scene.ngeom; i++) {
        const mjvGeom *tile = &shown.scene.geoms[i];
        if (is_tile(tile)) {
            check_tile(tile);
            area += 4 * (double)(tile->size[0] * tile->size[1] * tile->mat[8]);
            for (int k = 0; k < 2; k++) {
                low[k] = fmin(low[k], (double)tile->pos[k]);
                high[k] = fmax(high[k], (double)tile->pos[k]);
            }
        }
    }
    print_message("%.3f m^2 from (%.2f %.2f) to (%.2f %.2f)\n", area, low[0], low[1], high[0],
                  high[1]);
    assert_true(fabs(area - SIDE * SIDE) < 0.001 * SIDE * SIDE);
    assert_true(fabs((low[0] + high[0]) / 2 - 3.1) < 0.17);
    assert_true(fabs((low[1] + high[1]) / 2 + 7.4) < 0.17);
    hide(&shown);
}

/* Level ground, ground that the model shows by itself, hidden ground, and a scene without room. */
TEST(surface_is_left_out) {
    Shown shown;
    show(&shown, "", "", "", 0, 0);
    assert_int_equal(count_tiles(&shown), 0);
    hide(&shown);
    show(&shown, WAVES, HFIELD, "<geom type='hfield' hfield='hills' contype='0' conaffinity='0'/>",
         0, 0);
    assert_int_equal(count_tiles(&shown), 0);
    hide(&shown);
    show(&shown, WAVES, "", "", 0, 0);
    shown.option.flags[mjVIS_STATIC] = 0;
    assert_int_equal(count_tiles(&shown), 0);
    shown.option.flags[mjVIS_STATIC] = 1;
    mjv_freeScene(&shown.scene);
    mjv_makeScene(shown.m, &shown.scene, 100);
    assert_in_range(count_tiles(&shown), 90, 100);
    hide(&shown);
}

/* The plate of `show` falls; [m] how deep it then stands in the ground. */
static double press(Shown *shown) {
    kit_run(shown->m, shown->d, 2);
    return 0.01 - shown->d->qpos[2];
}

static int is_colour(const mjvGeom *geom, float r, float g, float b) {
    const float least = 0.5f, most = 1.01f; /* checks and depth darken it */
    const float share = geom->rgba[0] / r;
    return share > least && share < most && fabsf(geom->rgba[1] - share * g) < 1e-3f &&
           fabsf(geom->rgba[2] - share * b) < 1e-3f;
}

/* Another ground has another colour. */
static void check_other_colour(Shown *shown) {
    char error[300] = "";
    assert_int_equal(plugin_ground_change(shown->m, shown->d, NULL, 0, "name=rubber\nk_pen=900",
                                          error, sizeof error),
                     0);
    update(shown);
    for (int i = 0; i < shown->scene.ngeom; i++) {
        const mjvGeom *g = &shown->scene.geoms[i];
        assert_true(!is_tile(g) || is_colour(g, 0.35F, 0.35F, 0.38F));
    }
}

/* Level ground that is asked for: closed up to the horizon, under the plate as deep as the plate,
 * in the colour of the soil, and without patches. */
TEST(level_ground_is_dented) {
    Shown shown;
    double floor = 0, area = 0, whole = 0, middle[2] = {0, 0};
    int inside = 0, plates = 0, others = 0;
    show(&shown, CONFIG("surface", "1"), "", "", 3.1, -7.4);
    assert_int_equal(count_tiles(&shown), TILES + 4);
    const double depth = press(&shown);
    assert_true(depth > 0.003);
    update(&shown);
    for (int i = 0; i < shown.scene.ngeom; i++) {
        const mjvGeom *g = &shown.scene.geoms[i];
        if (!is_tile(g)) {
            others++;
            continue;
        }
        assert_true(is_colour(g, 0.70F, 0.58F, 0.40F));
        const double top = (double)(g->pos[2] + g->mat[8] * g->size[2]);
        const double x = (double)g->pos[0] - shown.d->qpos[0];
        const double y = (double)g->pos[1] - shown.d->qpos[1];
        const double size = 4 * (double)(g->size[0] * g->size[1] * g->mat[8]);
        plates++;
        whole += size;
        middle[0] += size * x;
        middle[1] += size * y;
        assert_true(top < 1e-6 && top > -1.02 * depth); /* sand springs back a little */
        if (fabs(x) < 0.07 && fabs(y) < 0.02) {         /* away from the walls */
            inside++;
            area += size;
            floor += size * top;
        } else if (fabs(x) > 0.15 || fabs(y) > 0.1) {
            assert_true(top > -1e-6);
        }
    }
    print_message("a plate %.2f mm deep: the ground under it %.2f mm, %d plates, %d more\n",
                  1e3 * depth, -1e3 * floor / area, inside, plates - TILES - 4);
    assert_true(inside >= 12);
    assert_true(fabs(-floor / area - depth) < 0.02 * depth);
    assert_true(plates > TILES + 4 + 60);
    assert_true(fabs(whole - 100.0 * 100.0) < 1);
    assert_true(fabs(middle[0] / whole) < 0.17 && fabs(middle[1] / whole) < 0.17);
    assert_int_equal(others, 1); /* the plate itself: no patches */
    check_other_colour(&shown);
    hide(&shown);
}

/* On a floor of the model: patches on it. */
TEST(a_floor_has_patches) {
    Shown shown;
    show(&shown, "", "", "", 0, 0);
    press(&shown);
    update(&shown);
    assert_true(shown.scene.ngeom > 30);
    for (int i = 0; i < shown.scene.ngeom; i++) {
        const mjvGeom *g = &shown.scene.geoms[i];
        assert_true(g->category != mjCAT_STATIC);
        assert_true(g->category != mjCAT_DECOR || (double)(g->pos[2] + g->size[2]) > 0);
    }
    hide(&shown);
}

/* Each label of a pattern has its colour. */
TEST(patterns_have_colours) {
    Shown shown;
    int sand = 0, grass = 0;
    show_on(&shown, "sand_loose grass", CONFIG("surface", "1") CONFIG("terrain.patches", "stripes"),
            "", "", 0, 0);
    update(&shown);
    for (int i = 0; i < shown.scene.ngeom; i++) {
        const mjvGeom *g = &shown.scene.geoms[i];
        if (is_tile(g)) {
            const int label = mild_terrain_material_at(&plugin_soft(shown.m, shown.d)->terrain,
                                                       (double)g->pos[0], (double)g->pos[1]);
            assert_true(label ? is_colour(g, 0.36F, 0.52F, 0.26F)
                              : is_colour(g, 0.70F, 0.58F, 0.40F));
            *(label ? &grass : &sand) += 1;
        }
    }
    assert_true(sand > 500 && grass > 500);
    hide(&shown);
}

TEST_MAIN(kit_setup, NULL)
