/* The ground in the scene: tiles that lie on the surface, beside each other, around the feet, and
 * follow what is pressed. */
#include "plugin_kit.h"

#include <math.h>

#include "plugin/plugin.h"

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

/* ---- the ground changes while it runs ---- */

#define PLATE                                                                                      \
    "<worldbody><body name='plate' pos='0 0 0.02'><freejoint/><geom type='box' size='.1 .05 .01' " \
    "mass='10' contype='0' conaffinity='0'/></body></worldbody></mujoco>"

static mjModel *plate_on(const char *ground, const char *more) {
    char head[1500], text[3000];
    kit_head(head, sizeof head, 0.002, "Euler", "plate", ground, more);
    snprintf(text, sizeof text, "%s%s", head, PLATE);
    return kit_model(text);
}

/* A plate on foam that is made sand is on sand: from the start with the same bits, and after it has
 * come to rest on the foam it goes on down, to where a plate rests that was put on the sand. */
TEST(changes_as_if_made_so) {
    char text[4000], error[300] = "";
    mjModel *foam = plate_on("foam60", ""), *sand = plate_on("sand_loose", "");
    mjData *d = mj_makeData(foam), *other = mj_makeData(sand);
    const int length = plugin_ground_print(sand, other, NULL, 0, text, sizeof text);
    assert_in_range(length, 200, sizeof text - 1);
    assert_int_equal(plugin_ground_change(foam, d, NULL, 0, text, error, sizeof error), 0);
    kit_run(foam, d, 1);
    kit_run(sand, other, 1);
    assert_memory_equal(d->qpos, other->qpos, (size_t)foam->nq * sizeof(double));
    const double wanted = 0.01 - d->qpos[2];
    mj_deleteData(d);

    d = mj_makeData(foam);
    kit_run(foam, d, 3);
    const double before = 0.01 - d->qpos[2];
    assert_int_equal(plugin_ground_change(foam, d, "soft", 0, text, error, sizeof error), 0);
    kit_run(foam, d, 3);
    const double after = 0.01 - d->qpos[2];
    print_message("foam %.2f mm, then sand %.2f mm, fallen on sand %.2f mm\n", 1e3 * before,
                  1e3 * after, 1e3 * wanted);
    assert_true(fabs(d->qvel[2]) < 1e-4);
    assert_true(after > 1.3 * before && after < wanted && after > 0.7 * wanted);

    char now[4000];
    assert_int_equal(plugin_ground_print(foam, d, "soft", 0, now, sizeof now), length);
    assert_string_equal(now, text);
    mjData *copy = mj_copyData(NULL, foam, d), *fresh = mj_makeData(foam);
    plugin_ground_print(foam, copy, NULL, 0, now, sizeof now);
    assert_string_equal(now, text); /* the change belongs to the data */
    plugin_ground_print(foam, fresh, NULL, 0, now, sizeof now);
    assert_string_not_equal(now, text);
    mj_resetData(foam, d);
    plugin_ground_print(foam, d, NULL, 0, now, sizeof now);
    assert_string_equal(now, text);
    mj_deleteData(copy);
    mj_deleteData(fresh);
    mj_deleteData(d);
    mj_deleteData(other);
    mj_deleteModel(foam);
    mj_deleteModel(sand);
}

/* A preset is matched to the model of the ground, as that of the file was. */
TEST(model_stays) {
    char text[4000], now[4000], error[300] = "";
    const char *bekker = CONFIG("ground.model", "bekker");
    mjModel *m = plate_on("sand_dense", bekker), *made = plate_on("sand_loose", bekker);
    mjModel *mild = plate_on("sand_loose", "");
    mjData *d = mj_makeData(m), *wanted = mj_makeData(made), *plain = mj_makeData(mild);
    plugin_ground_print(mild, plain, NULL, 0, text, sizeof text);
    assert_int_equal(plugin_ground_change(m, d, NULL, 0, text, error, sizeof error), 0);
    plugin_ground_print(m, d, NULL, 0, now, sizeof now);
    plugin_ground_print(made, wanted, NULL, 0, text, sizeof text);
    assert_string_equal(now, text);
    plugin_ground_change(mild, plain, NULL, 0, "mu=0.25", error, sizeof error);
    assert_int_equal(plugin_ground_change(mild, plain, NULL, 0, text, error, sizeof error), -1);
    assert_names(error, "bekker");
    mj_deleteData(d);
    mj_deleteData(wanted);
    mj_deleteData(plain);
    mj_deleteModel(m);
    mj_deleteModel(made);
    mj_deleteModel(mild);
}

/* What is wrong changes nothing. */
TEST(refuses) {
    static const struct {
        const char *name;
        int label;
        const char *text;
    } wrong[] = {{"other", 0, "mu=0.3"},
                 {NULL, 1, "mu=0.3"},
                 {NULL, -1, "mu=0.3"},
                 {NULL, 0, "mu"},
                 {NULL, 0, "my=0.3"},
                 {NULL, 0, "mu=-1"},
                 {NULL, 0, "mu=x"},
                 {NULL, 0, "mu=0.3\nk_pen=nan"},
                 {NULL, 0, "plate_width=1e-9"}};
    char before[4000], now[4000];
    mjModel *m = plate_on("sand_loose", "");
    mjData *d = mj_makeData(m);
    plugin_ground_print(m, d, NULL, 0, before, sizeof before);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        char error[300] = "";
        assert_int_equal(plugin_ground_change(m, d, wrong[i].name, wrong[i].label, wrong[i].text,
                                              error, sizeof error),
                         -1);
        assert_true(error[0]);
        plugin_ground_print(m, d, NULL, 0, now, sizeof now);
        assert_string_equal(now, before);
    }
    assert_int_equal(plugin_ground_print(m, d, NULL, 1, now, sizeof now), -1);
    assert_true(plugin_ground_print(m, d, NULL, 0, now, 10) > 10); /* cut off */
    assert_int_equal(strlen(now), 9);
    mj_deleteData(d);
    mj_deleteModel(m);
}

/* The labels of a pattern change each by itself. */
TEST(labels) {
    char text[4000], error[300] = "";
    mjModel *m = plate_on("foam45 grass", CONFIG("terrain.patches", "stripes"));
    mjData *d = mj_makeData(m);
    assert_int_equal(plugin_ground_change(m, d, NULL, 1, "mu=0.123", error, sizeof error), 0);
    plugin_ground_print(m, d, NULL, 1, text, sizeof text);
    assert_non_null(strstr(text, "\nmu=0.123\n"));
    plugin_ground_print(m, d, NULL, 0, text, sizeof text);
    assert_null(strstr(text, "\nmu=0.123\n"));
    mj_deleteData(d);
    mj_deleteModel(m);
}

TEST_MAIN(kit_setup, NULL)
