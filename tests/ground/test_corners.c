/* Corners that random states seldom visit: a slide into a deeper imprint, maps without a pattern,
 * patterns at the limit of their work. */
#include "ground_kit.h"

#include "mild/map.h"

enum { TILES = 64 };

/* Leads the plate (A = 0) to x, z in `steps` equal steps; the last step's vertical force [N]. */
static double lead(Kit *kit, double x, double z, int steps) {
    const double from_x = kit->input.position[0][0], from_z = kit->input.position[0][2];
    const double to_z = -KIT_SOLE_Z + z;
    for (int s = 1; s <= steps; s++) {
        kit->input.free_velocity[0] = (x - from_x) / steps / kit->input.dt;
        kit->input.free_velocity[2] = (to_z - from_z) / steps / kit->input.dt;
        kit_solve(kit);
        kit_advance(kit);
        kit->input.position[0][0] = from_x + (x - from_x) * s / steps;
        kit->input.position[0][2] = from_z + (to_z - from_z) * s / steps;
    }
    return kit->result.foot[0].force[2];
}

/* A print of 20 mm at x = 0. A foot 5 mm deep slides there from x = 0.3 m: on the way virgin ground
 * carries it, over the print nothing does, and what it leaves there is the old print. One that
 * comes at 25 mm is carried by virgin ground all the way. */
TEST(test_slide_into_imprint) {
    MildSole *sole = kit_plate(3, 3);
    MildMaterial m = kit_preset("grass");
    m.recovery = 0.0;
    m.c_g = 0.0;
    for (int deep = 0; deep < 2; deep++) {
        const double depth = deep ? 0.025 : 0.005;
        Kit kit;
        kit_open(&kit, 1, sole, NULL, &m, 1e-3);
        kit_prints(&kit, TILES);
        const double y = kit.input.position[0][1];
        lead(&kit, 0.0, -0.02, 100);
        lead(&kit, 0.0, -0.02, 1); /* a print is as deep as the middle of the deepest step */
        lead(&kit, 0.0, 0.01, 100);
        lead(&kit, 0.3, 0.01, 10);
        lead(&kit, 0.3, -depth, 50);
        const double virgin = 9.0 * mild_element_law(&m, KIT_PITCH, depth).force;
        const double on_the_way = lead(&kit, 0.15, -depth, 150);
        const double inside = lead(&kit, 0.0, -depth, 150);
        lead(&kit, 0.0, 0.01, 50);
        const double left = mild_ground_imprint_at(kit.ground, 0.0, y);
        print_message("slid %.0f mm deep: carries %.3f of virgin ground's force on the way, %.3f "
                      "over the print of 20 mm, and leaves %.2f mm\n",
                      1e3 * depth, on_the_way / virgin, inside / virgin, 1e3 * left);
        assert_true(fabs(on_the_way / virgin - 1.0) < 0.02);
        assert_true(deep ? fabs(inside / virgin - 1.0) < 0.02 : inside == 0.0);
        assert_true(fabs(left - (deep ? depth : 0.02)) < 1e-5);
        kit_close(&kit);
    }
    mild_sole_destroy(sole);
}

TEST(test_labels) {
    static const int patterns[] = {MILD_PATTERN_NONE, MILD_PATTERN_STRIPES, MILD_PATTERN_CHECKER};
    for (int k = 0; k < 3; k++) {
        for (int count = 1; count <= 4; count++) {
            MildError error = {0};
            MildMapDef def = mild_map_def_default();
            def.patches = patterns[k];
            def.patch_count = count;
            MildMap *map = mild_map_create(&def, &error);
            expect_good(map != NULL, &error);
            assert_int_equal(mild_map_label_count(map), k ? count : 1);
            mild_map_destroy(map);
        }
    }
}

/* Stripes look along x only, so they may blend over a border that is too much work for a
 * checker. */
TEST(test_work_of_borders) {
    for (int checker = 0; checker < 2; checker++) {
        MildError error = {0};
        MildMapDef def = mild_map_def_default();
        def.patches = checker ? MILD_PATTERN_CHECKER : MILD_PATTERN_STRIPES;
        def.patch_size = 1.0;
        def.cell = 0.002;
        def.border = 0.8;
        MildMap *map = mild_map_create(&def, &error);
        assert_true((map == NULL) == checker);
        if (checker) {
            assert_error(&error, MILD_ERROR_RANGE,
                         "terrain.patches terrain.cell terrain.border 0.8");
        }
        mild_map_destroy(map);
    }
}

TEST_MAIN(NULL, NULL)
