/* The visible ground: prints where the sole was, as deep as it was, and recovery by material. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "view/relief.h"

#define RANGE 0.2
#define CELL 0.01
#define DEPTH 0.03

static const double outline[] = {-0.07, -0.05, 0.20, -0.05, 0.20, 0.05, -0.07, 0.05};
static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
static MildSole *sole;
static Relief *relief;
static MildTerrain terrain;

static void make(const char *material, int rigid) {
    MildError error = {0};
    MildMaterial m;
    assert_true(mild_material_preset(material, &m));
    terrain = mild_terrain_uniform(&m);
    MildSoleDef def = {.outline = outline, .points = 4, .pitch = 0.0195, .sole_z = -0.055};
    sole = mild_sole_create(&def, &error);
    assert_non_null(sole);
    const MildSole *soles[1] = {sole};
    ReliefDef area = {-1, 1, -1, 1, CELL, rigid, &material};
    relief = relief_create(&area, &terrain, soles, 1, &error);
    assert_non_null(relief);
}

static void destroy(void) {
    relief_destroy(relief);
    mild_sole_destroy(sole);
}

static void press(double x, double y, double depth) {
    const double position[1][3] = {{x, y, 0.055 - depth}};
    double rotation[1][9];
    memcpy(rotation[0], identity, sizeof identity);
    relief_press(relief, position, (const double(*)[9])rotation);
}

/* Drawn depth at the vertex nearest to (x, y). */
static double depth_at(double x, double y) {
    static float heights[RELIEF_TILE_VERTICES * RELIEF_TILE_VERTICES];
    double edge = relief_tile_edge(relief), first[2], center[2];
    relief_tile_center(relief, 0, first);
    int column = (int)floor((x - first[0]) / edge + 0.5),
        row = (int)floor((y - first[1]) / edge + 0.5);
    int tile = row * relief_tile_columns(relief) + column;
    relief_tile_center(relief, tile, center);
    relief_tile_heights(relief, tile, RANGE, 1, heights);
    int i = (int)lround((x - center[0] + 0.5 * edge) / CELL),
        j = (int)lround((y - center[1] + 0.5 * edge) / CELL);
    return RANGE * (1.0 - (double)heights[j * RELIEF_TILE_VERTICES + i]);
}

static double print_after_lift(const char *material) {
    make(material, 0);
    press(0.1, 0.05, DEPTH);
    assert_true(fabs(depth_at(0.15, 0.05) - DEPTH) < 0.002); /* under the sole */
    assert_true(fabs(depth_at(0.15, 0.20)) < 1e-6);          /* beside it */
    assert_true(fabs(depth_at(-0.05, 0.05)) < 1e-6);         /* behind the heel */
    press(0.1, 0.05, -0.05);
    double left = depth_at(0.15, 0.05);
    destroy();
    return left;
}

static void recovery_by_material(void **state) {
    (void)state;
    double foam = print_after_lift("foam45"), sand = print_after_lift("sand_loose"),
           grass = print_after_lift("grass");
    print_message("print left of %.0f mm: foam45 %.1f, grass %.1f, sand_loose %.1f mm\n",
                  1e3 * DEPTH, 1e3 * foam, 1e3 * grass, 1e3 * sand);
    assert_true(foam < 1e-6);
    assert_true(fabs(sand - DEPTH) < 0.002);
    assert_true(fabs(grass - 0.5 * DEPTH) < 0.002);
}

static void print_stays_when_the_foot_walks_on(void **state) {
    (void)state;
    make("sand_loose", 0);
    press(-0.3, 0, DEPTH);
    press(0.3, 0, 0.5 * DEPTH);
    assert_true(fabs(depth_at(-0.25, 0) - DEPTH) < 0.002);
    assert_true(fabs(depth_at(0.35, 0) - 0.5 * DEPTH) < 0.002);
    destroy();
}

/* Neighbouring tiles share their edge: both must be refreshed and agree. */
static void tiles_agree_on_their_edge(void **state) {
    (void)state;
    make("sand_loose", 0);
    double edge = relief_tile_edge(relief), first[2];
    relief_tile_center(relief, 0, first);
    press(first[0] + 0.5 * edge - 0.06, first[1], DEPTH);
    assert_true(relief_tile_take_dirty(relief, 0));
    assert_true(relief_tile_take_dirty(relief, 1));
    assert_false(relief_tile_take_dirty(relief, 0));
    assert_false(relief_tile_touched(relief, 2));
    static float a[RELIEF_TILE_VERTICES * RELIEF_TILE_VERTICES],
        b[RELIEF_TILE_VERTICES * RELIEF_TILE_VERTICES];
    relief_tile_heights(relief, 0, RANGE, 1, a);
    relief_tile_heights(relief, 1, RANGE, 1, b);
    int low = 0;
    for (int j = 0; j < RELIEF_TILE_VERTICES; j++) {
        assert_true(a[j * RELIEF_TILE_VERTICES + RELIEF_TILE_CELLS] == b[j * RELIEF_TILE_VERTICES]);
        low += b[j * RELIEF_TILE_VERTICES] < 1.0F;
    }
    assert_true(low > 5);
    destroy();
}

static void pressed_ground_is_darker(void **state) {
    (void)state;
    make("sand_loose", 0);
    static unsigned char before[RELIEF_TILE_PIXELS * RELIEF_TILE_PIXELS * 3], after[sizeof before];
    double center[2];
    int tile = relief_tile_columns(relief) + 1;
    relief_tile_center(relief, tile, center);
    relief_tile_pixels(relief, tile, before);
    press(center[0] - 0.06, center[1], DEPTH);
    relief_tile_pixels(relief, tile, after);
    size_t middle = 3 * (RELIEF_TILE_PIXELS / 2 * RELIEF_TILE_PIXELS + RELIEF_TILE_PIXELS / 2),
           corner = 0;
    assert_true(after[middle] < before[middle]);
    assert_int_equal(after[corner], before[corner]);
    destroy();
}

static void rigid_ground_never_yields(void **state) {
    (void)state;
    make("sand_loose", 1);
    press(0, 0, DEPTH);
    assert_true(depth_at(0.05, 0) == 0.0);
    assert_int_equal(relief_tile_material(relief, 0), RELIEF_RIGID);
    destroy();
}

/* On uneven ground heights are those of the map, and a print lies as deep below it as on level
 * ground. */
static void prints_follow_the_map(void **state) {
    (void)state;
    MildError error = {0};
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_WAVES;
    def.amplitude = 0.05;
    MildMap *map = mild_map_create(&def, &error);
    make("sand_loose", 0);
    const MildSole *soles[1] = {sole};
    const char *names[1] = {"sand_loose"};
    ReliefDef area = {-1, 1, -1, 1, CELL, 0, names};
    terrain.map = map;
    relief_destroy(relief);
    relief = relief_create(&area, &terrain, soles, 1, &error);
    assert_true(relief_is_uneven(relief) && relief_low(relief) < -0.045 &&
                relief_high(relief) > 0.045);
    static float heights[RELIEF_TILE_VERTICES * RELIEF_TILE_VERTICES];
    double edge = relief_tile_edge(relief), center[2], worst = 0,
           range = relief_high(relief) - relief_low(relief) + RANGE;
    press(0.05, 0.0, DEPTH);
    for (int tile = 0; tile < relief_tile_columns(relief) * relief_tile_rows(relief); tile++) {
        relief_tile_center(relief, tile, center);
        relief_tile_heights(relief, tile, RANGE, 1, heights);
        for (int j = 0; j < RELIEF_TILE_VERTICES; j += 4) {
            for (int i = 0; i < RELIEF_TILE_VERTICES; i += 4) {
                double x = center[0] - 0.5 * edge + CELL * i, y = center[1] - 0.5 * edge + CELL * j;
                double z = relief_low(relief) - RANGE +
                           range * (double)heights[j * RELIEF_TILE_VERTICES + i];
                double wanted = mild_terrain_height_at(&terrain, x, y);
                if (x > -0.01 && x < 0.24 && fabs(y) < 0.045) {
                    wanted = fmin(wanted, -DEPTH);
                } else if (x > -0.05 && x < 0.28 && fabs(y) < 0.075) {
                    continue; /* beside the sole's edge */
                }
                worst = fmax(worst, fabs(z - wanted));
            }
        }
    }
    print_message("drawn heights on waves: off by %.2f mm\n", 1e3 * worst);
    assert_true(worst < 2.5e-3);
    destroy();
    mild_map_destroy(map);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(recovery_by_material),
        cmocka_unit_test(print_stays_when_the_foot_walks_on),
        cmocka_unit_test(tiles_agree_on_their_edge),
        cmocka_unit_test(pressed_ground_is_darker),
        cmocka_unit_test(rigid_ground_never_yields),
        cmocka_unit_test(prints_follow_the_map),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
