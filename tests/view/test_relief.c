/* The visible ground: prints where the sole was, as deep as it was, and recovery by material; and
 * shells that stand press it too. */
#include "robots.h"
#include "sa01.h"
#include "view/relief.h"
#include "view/view.h"

#define CELL 0.01
#define GAP 0.0015 /* [m] the surface is drawn this far below a sole */
#define VERTICES (RELIEF_TILE_VERTICES * RELIEF_TILE_VERTICES)
#define DEPTH 0.03

static const double outline[] = {-0.07, -0.05, 0.20, -0.05, 0.20, 0.05, -0.07, 0.05};
static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
static MildSole *sole;
static Relief *relief;
static MildTerrain terrain;

static void make(const char *material, int rigid) {
    MildError error = {0};
    terrain = kit_terrain(material);
    MildSoleDef def = {.outline = outline, .points = 4, .pitch = 0.0195, .sole_z = -0.055};
    sole = mild_sole_create(&def, &error);
    assert_non_null(sole);
    const MildSole *soles[1] = {sole};
    ReliefDef area = {-1, 1, -1, 1, CELL, rigid, &material, 1};
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
    relief_press(relief, 0, position, (const double(*)[9])rotation);
}

static void press_tilted(const double position[3], double pitch) {
    const double c = cos(pitch), n = sin(pitch);
    const double rotation[1][9] = {{c, 0, n, 0, 1, 0, -n, 0, c}};
    relief_press(relief, 0, (const double(*)[3])position, rotation);
}

static double depth_at(double x, double y) {
    return relief_depth_at(relief, x, y);
}

/* Under every element of a pressed, tilted sole the surface is as deep as the element's centre. */
TEST(dent_is_as_deep_as_the_elements) {
    const char *grounds[] = {"foam25", "rubber", "sand_loose"};
    double worst = 0;
    for (int g = 0; g < 3; g++) {
        for (int k = -1; k <= 1; k++) {
            const double pitch = 0.05 * k, position[3] = {0.031, -0.017, 0.055 - 0.035};
            make(grounds[g], 0);
            press_tilted(position, pitch);
            for (int e = 0; e < mild_sole_elements(sole); e++) {
                double px = mild_sole_x(sole)[e], pz = mild_sole_z(sole);
                double x = position[0] + cos(pitch) * px + sin(pitch) * pz;
                double y = position[1] + mild_sole_y(sole)[e];
                double depth = -(position[2] - sin(pitch) * px + cos(pitch) * pz);
                worst = fmax(worst, fabs(depth_at(x, y) - depth - GAP));
            }
            destroy();
        }
    }
    print_message("drawn depth under an element: off by %.3f mm\n", 1e3 * worst);
    assert_true(worst < 1e-5);
}

/* Walks away from the edge of the sole: the surface rises without a step and ends at 0. Grains
 * stand steeper than a sheet. */
static double skirt_width(const char *material) {
    const double edge = 0.05 + 0.5 * CELL; /* the raster's squares and the gap beside the sole */
    make(material, 0);
    press(0, 0, DEPTH);
    double before = depth_at(0.06, 0), width = 0, steepest = 0;
    assert_true(fabs(before - DEPTH - GAP) < 1e-6);
    for (double y = 0; y < 0.25; y += 0.001) {
        double depth = depth_at(0.06, y);
        assert_true(depth <= before + 1e-9);
        steepest = fmax(steepest, (before - depth) / 0.001);
        width = depth > 1e-6 ? y - edge : width;
        before = depth;
    }
    assert_true(before == 0);
    print_message("%s: slope %.0f mm wide, at most %.2f\n", material, 1e3 * width, steepest);
    assert_true(steepest < 2.2);
    destroy();
    return width;
}

TEST(surface_rises_smoothly_beside_the_sole) {
    /* 31.5 mm deep, recovery 0, 0.5, 1; a vertex of the grid farther at most */
    assert_true(fabs(skirt_width("sand_loose") - 0.0246) < 1.1 * CELL);
    assert_true(fabs(skirt_width("grass") - 0.0462) < 1.1 * CELL);
    assert_true(fabs(skirt_width("foam45") - 0.0678) < 1.1 * CELL);
}

/* The dent follows a foot that is lifted slowly: foam back to the sole at every height, grass half
 * of the way, sand not. */
TEST(dent_follows_the_lifted_foot) {
    make("foam25", 0);
    for (double depth = DEPTH; depth > 0; depth -= 0.005) {
        press(0.1, 0.05, depth);
        assert_true(fabs(depth_at(0.15, 0.05) - depth - GAP) < 1e-6);
    }
    assert_true(relief_tile_pressed(relief, 4) || relief_tile_pressed(relief, 5) ||
                relief_tile_pressed(relief, 9) || relief_tile_pressed(relief, 10));
    press(0.1, 0.05, -0.02);
    for (int tile = 0; tile < relief_tile_columns(relief) * relief_tile_rows(relief); tile++) {
        assert_false(relief_tile_pressed(relief, tile));
    }
    destroy();
    const char *lasting[] = {"sand_loose", "grass"};
    for (int k = 0; k < 2; k++) {
        make(lasting[k], 0);
        press(0.1, 0.05, DEPTH);
        press(0.1, 0.05, k ? -0.05 : 0.01);
        assert_true(fabs(depth_at(0.15, 0.05) - (DEPTH + GAP) / (1 + k)) < 1e-6);
        destroy();
    }
}

/* Normals against differences of the drawn depth; unit length; upright where nothing was pressed.
 */
TEST(normals_are_those_of_the_surface) {
    static float position[3 * VERTICES], normal[3 * VERTICES];
    make("foam28", 0);
    press(0.1, 0.05, DEPTH);
    double worst = 0, steepest = 0;
    for (int tile = 0; tile < relief_tile_columns(relief) * relief_tile_rows(relief); tile++) {
        relief_tile_surface(relief, tile, 1, position, normal);
        for (int v = 0; v < VERTICES; v++) {
            double x = (double)position[3 * v], y = (double)position[3 * v + 1];
            if (fabs(x) > 0.9 || fabs(y) > 0.9) {
                continue;
            }
            const float *n = normal + 3 * v;
            double sx = (depth_at(x + CELL, y) - depth_at(x - CELL, y)) / (2 * CELL);
            double sy = (depth_at(x, y + CELL) - depth_at(x, y - CELL)) / (2 * CELL);
            worst = fmax(worst, fabs((double)(n[0] / n[2]) - sx));
            worst = fmax(worst, fabs((double)(n[1] / n[2]) - sy));
            worst = fmax(worst, fabs((double)(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]) - 1));
            assert_true(fabs((double)position[3 * v + 2] + depth_at(x, y)) < 1e-4);
            steepest = fmax(steepest, hypot(sx, sy));
        }
    }
    print_message("normals off by %.1e, steepest slope %.2f\n", worst, steepest);
    assert_true(worst < 1e-2 && steepest > 0.4);
    destroy();
}

/* Neighbouring tiles share their edge: both must be refreshed and agree. */
TEST(tiles_agree_on_their_edge) {
    make("sand_loose", 0);
    double edge = relief_tile_edge(relief), first[2];
    relief_tile_center(relief, 0, first);
    press(first[0] + 0.5 * edge - 0.06, first[1], DEPTH);
    assert_true(relief_tile_take_dirty(relief, 0));
    assert_true(relief_tile_take_dirty(relief, 1));
    assert_false(relief_tile_take_dirty(relief, 0));
    assert_false(relief_tile_pressed(relief, 2));
    static float a[3 * VERTICES], b[3 * VERTICES], na[3 * VERTICES], nb[3 * VERTICES];
    relief_tile_surface(relief, 0, 1, a, na);
    relief_tile_surface(relief, 1, 1, b, nb);
    int low = 0;
    for (int j = 0; j < RELIEF_TILE_VERTICES; j++) {
        int right = 3 * (j * RELIEF_TILE_VERTICES + RELIEF_TILE_CELLS),
            left = 3 * j * RELIEF_TILE_VERTICES;
        assert_memory_equal(a + right, b + left, 3 * sizeof *a);
        assert_memory_equal(na + right, nb + left, 3 * sizeof *na);
        low += b[left + 2] < 0.0F;
    }
    assert_true(low > 5);
    destroy();
}

/* A vertex beside a tile turns the normals of its edge: that tile must be drawn again, too. */
TEST(neighbours_are_refreshed) {
    int beside = 0;
    for (int k = 0; k < 40; k++) {
        make("sand_loose", 0);
        double edge = relief_tile_edge(relief), first[2];
        relief_tile_center(relief, 0, first);
        double seam = first[0] + 0.5 * edge;
        press(seam - 0.2 - 0.002 * k, first[1], 0.5 * DEPTH);
        if (depth_at(seam - CELL, first[1]) > 1e-6 && depth_at(seam, first[1]) < 1e-6) {
            assert_true(relief_tile_take_dirty(relief, 1));
            beside++;
        }
        destroy();
        make("sand_loose", 0);
        press(seam + 0.07 + 0.002 * k, first[1], 0.5 * DEPTH);
        if (depth_at(seam + CELL, first[1]) > 1e-6 && depth_at(seam, first[1]) < 1e-6) {
            assert_true(relief_tile_take_dirty(relief, 0));
            beside++;
        }
        destroy();
    }
    assert_true(beside > 4);
}

TEST(pressed_ground_is_darker) {
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

TEST(rigid_ground_never_yields) {
    make("sand_loose", 1);
    press(0, 0, DEPTH);
    assert_true(depth_at(0.05, 0) == 0.0);
    assert_int_equal(relief_tile_material(relief, 0), RELIEF_RIGID);
    destroy();
}

/* On uneven ground heights are those of the map, and a print lies as deep below it as on level
 * ground. */
TEST(prints_follow_the_map) {
    MildError error = {0};
    MildMapDef def = mild_map_def_default();
    def.kind = MILD_MAP_WAVES;
    def.amplitude = 0.05;
    MildMap *map = mild_map_create(&def, &error);
    make("sand_loose", 0);
    const MildSole *soles[1] = {sole};
    const char *names[1] = {"sand_loose"};
    ReliefDef area = {-1, 1, -1, 1, CELL, 0, names, 1};
    terrain.map = map;
    relief_destroy(relief);
    relief = relief_create(&area, &terrain, soles, 1, &error);
    assert_true(relief_is_uneven(relief) && relief_low(relief) < -0.045);
    static float position[3 * VERTICES], normal[3 * VERTICES];
    double worst = 0;
    press(0.05, 0.0, DEPTH);
    for (int tile = 0; tile < relief_tile_columns(relief) * relief_tile_rows(relief); tile++) {
        relief_tile_surface(relief, tile, 4, position, normal);
        for (int v = 0; v < (RELIEF_TILE_CELLS / 4 + 1) * (RELIEF_TILE_CELLS / 4 + 1); v++) {
            double x = (double)position[3 * v], y = (double)position[3 * v + 1],
                   z = (double)position[3 * v + 2];
            double wanted = mild_terrain_height_at(&terrain, x, y);
            if (x > -0.01 && x < 0.24 && fabs(y) < 0.045) {
                wanted = fmin(wanted, -DEPTH);
            } else if (x > -0.12 && x < 0.35 && fabs(y) < 0.15) {
                continue; /* beside the sole's edge */
            }
            worst = fmax(worst, fabs(z - wanted));
        }
    }
    print_message("drawn heights on waves: off by %.2f mm\n", 1e3 * worst);
    assert_true(worst < 2.5e-3);
    destroy();
    mild_map_destroy(map);
}

/* ---- shells ---- */

#define DT 0.002
#define WIDTH 480
#define HEIGHT 270

static Robot *robot;
static RobotSim *sim;
static MildGround *ground;

static int setup(void **state) {
    (void)state;
    MildError error = {0};
    robot = kit_robot(SA01);
    robot_set_shells(robot, 1);
    sim = robot_sim_create(robot, DT, &error);
    assert_non_null(sim);
    ground = kit_ground(robot);
    return 0;
}

static int teardown(void **state) {
    (void)state;
    free(ground);
    robot_sim_destroy(sim);
    robot_destroy(robot);
    return 0;
}

static void lay_ground(const char *name) {
    terrain = kit_terrain(name);
}

/* [rad] The knees are bent, so that the shanks' upper ends press. */
static double wanted(int joint) {
    return joint % 6 == 3 ? 1.2 : robot_default_pose(robot)[joint];
}

/* Face down, above the ground. */
static void load_at(double height) {
    const RobotVariation nominal = robot_variation_nominal();
    RobotState start = {.qpos = {0, 0, height, sqrt(0.5), 0, sqrt(0.5), 0}};
    for (int i = 0; i < SA01_JOINTS; i++) {
        start.qpos[7 + i] = wanted(i);
    }
    mild_ground_reset(ground);
    robot_sim_load(sim, &start, &nominal);
}

/* The motors hold that pose. */
static void step(void) {
    double torque[SA01_JOINTS];
    for (int i = 0; i < SA01_JOINTS; i++) {
        const double q = robot_sim_qpos(sim)[7 + i], qd = robot_sim_qvel(sim)[6 + i];
        torque[i] = robot_kp(robot)[i] * (wanted(i) - q) - robot_kd(robot)[i] * qd;
    }
    assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
}

static void lie_down(View *view) {
    load_at(0.2);
    for (int i = 0; i < 750; i++) {
        step();
        if (view && i % 5 == 0) {
            view_observe(view, sim);
        }
    }
}

/* The elements of body b in the last step. */
static int body_facets(int b, Facet *facets) {
    const MildElements now = mild_scratch_elements(robot_sim_scratch(sim), b);
    const double *turn = robot_sim_contact_input(sim)->rotation[b];
    return facets_of(robot_soles(robot)[b], turn, &now, facets);
}

/* On foam: the drawn surface is where the elements of shanks and base are, and level again
 * once they are gone. A shank leans, and a cell is 10 mm wide. */
TEST_WITH(dents_are_where_the_shells_are, setup, teardown) {
    MildError error = {0};
    const ReliefDef area = {-1.5, 1.5, -1, 1, 0.01, 0, NULL, 1};
    lay_ground("foam25");
    Relief *relief = relief_create(&area, &terrain, robot_rasters(robot), SA01_FEET, &error);
    assert_non_null(relief);
    lie_down(NULL);
    for (int b = SA01_FEET; b < robot_bodies(robot); b++) {
        const MildSole *surface = robot_soles(robot)[b];
        Facet *facets = malloc((size_t)mild_sole_elements(surface) * sizeof *facets);
        double worst = 0, deepest = 0;
        const int count = body_facets(b, facets);
        relief_press_facets(relief, facets, count);
        for (int n = 0; n < count; n++) { /* steeper ones are narrower than a cell */
            const double *at = facets[n].at;
            if (hypot(facets[n].slope[0], facets[n].slope[1]) < 1 && at[2] < 0) {
                worst = fmax(worst, fabs(relief_depth_at(relief, at[0], at[1]) + at[2]));
                deepest = fmax(deepest, -at[2]);
            }
        }
        print_message("body %d on foam25: %d elements drawn, up to %.1f mm deep, drawn "
                      "within %.1f mm (bound 15)\n",
                      b, count, 1e3 * deepest, 1e3 * worst);
        assert_true(deepest > 0.015 && worst < 0.015);
        relief_press_facets(relief, NULL, 0);
        for (int n = 0; n < count; n++) {
            assert_true(relief_depth_at(relief, facets[n].at[0], facets[n].at[1]) == 0);
        }
        free(facets);
    }
    relief_destroy(relief);
}

static int pixels_different(const unsigned char *a, const unsigned char *b, size_t count) {
    int different = 0;
    for (size_t i = 0; i < count; i++) {
        different += abs((int)a[i] - (int)b[i]) > 12;
    }
    return different;
}

/* The robot lies in sand and is taken away: its imprint is seen. The feet press nothing. */
TEST_WITH(imprints_are_seen, setup, teardown) {
    const size_t bytes = (size_t)3 * WIDTH * HEIGHT;
    const char *names[] = {"sand_loose"};
    MildError error = {0};
    ViewInfo info = {0};
    ViewDef def = view_def_default();
    def.width = WIDTH, def.height = HEIGHT;
    def.x_min = -1.5, def.x_max = 1.5, def.y_min = -1, def.y_max = 1;
    def.names = names;
    lay_ground("sand_loose");
    View *view = view_create(&def, robot, &terrain, &error);
    if (!view) {
        assert_error(&error, MILD_ERROR_IO, "apt-get");
        skip();
    }
    unsigned char *empty = malloc(bytes);
    load_at(3);
    step();
    view_frame(view, sim, &info);
    memcpy(empty, view_pixels(view), bytes);
    lie_down(view);
    load_at(3);
    step();
    view_frame(view, sim, &info);
    const int seen = pixels_different(empty, view_pixels(view), bytes);
    print_message("the imprint of a robot that lay in sand changes %d samples of %zu\n", seen,
                  bytes);
    assert_true(seen > 1000);
    free(empty);
    view_destroy(view);
}

TEST_MAIN(NULL, NULL)
