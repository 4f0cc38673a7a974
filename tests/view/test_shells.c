/* Shells that stand on the ground press what is drawn of it. */
#include "robots.h"
#include "sa01.h"
#include "view/relief.h"
#include "view/view.h"

#define DT 0.002
#define WIDTH 480
#define HEIGHT 270

static Robot *robot;
static RobotSim *sim;
static MildTerrain terrain;
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
TEST(dents_are_where_the_shells_are) {
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
TEST(imprints_are_seen) {
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

TEST_MAIN(setup, teardown)
