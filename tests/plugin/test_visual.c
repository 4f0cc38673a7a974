/* Uneven ground in the scene: tiles that lie on the surface, beside each other, around the feet. */
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

/* A plate at (x, y) on ground with these keys. */
static void show(Shown *shown, const char *keys, const char *asset, const char *geom, double x,
                 double y) {
    char head[1500], text[3000];
    kit_head(head, sizeof head, 0.002, "Euler", "plate", "sand_loose", keys);
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

static void tiles_lie_on_the_surface(void **state) {
    (void)state;
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
static void surface_is_left_out(void **state) {
    (void)state;
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiles_lie_on_the_surface),
        cmocka_unit_test(surface_is_left_out),
    };
    return cmocka_run_group_tests(tests, kit_setup, NULL);
}
