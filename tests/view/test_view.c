/* Frames of the real robot on soft ground, and the sole pressure gathered from it. */
#include <unistd.h>

#include "control/stand.h"
#include "robots.h"
#include "sa01.h"
#include "view/model.h"
#include "view/pressure.h"
#include "view/relief.h"
#include "view/view.h"

#define MODEL SA01
#define DT 0.002

static const char *names[] = {"sand_loose"};
static Robot *robot;
static Stand *stand;
static RobotSim *sim;
static MildTerrain terrain;
static MildGround *ground;

static int setup(void **state) {
    (void)state;
    MildError error = {0};
    terrain = kit_terrain("sand_loose");
    robot = kit_robot(MODEL);
    stand = stand_create(robot, &error);
    sim = robot_sim_create(robot, DT, &error);
    assert_non_null(sim);
    ground = kit_ground(robot);
    return 0;
}

static int teardown(void **state) {
    (void)state;
    free(ground);
    robot_sim_destroy(sim);
    stand_destroy(stand);
    robot_destroy(robot);
    return 0;
}

static void load_at(double height) {
    RobotVariation nominal = robot_variation_nominal();
    RobotState start = stand_state(stand, 1, 0.0);
    start.qpos[2] += height;
    mild_ground_reset(ground);
    robot_sim_load(sim, &start, &nominal);
}

static void step(void) {
    double torque[SA01_JOINTS];
    stand_torque(stand, sim, 1, torque);
    assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
}

static View *small_view(MildError *error) {
    ViewDef def = view_def_default();
    def.width = 240, def.height = 136;
    def.x_min = -1, def.x_max = 1, def.y_min = -1, def.y_max = 1;
    def.names = names;
    return view_create(&def, robot, &terrain, error);
}

static int pixels_different(const unsigned char *a, const unsigned char *b, size_t count) {
    int different = 0;
    for (size_t i = 0; i < count; i++) {
        different += abs((int)a[i] - (int)b[i]) > 12;
    }
    return different;
}

/* The robot lands in sand and is taken away: the picture must show it, and then the prints that it
 * left. */
TEST(robot_and_prints_are_seen) {
    const size_t bytes = (size_t)240 * 136 * 3;
    MildError error = {0};
    View *view = small_view(&error);
    if (!view) { /* a machine without any OpenGL: the error must say what to install */
        assert_error(&error, MILD_ERROR_IO, "apt-get");
        skip();
    }
    ViewInfo info = {0};
    unsigned char *empty = malloc(bytes), *standing = malloc(bytes);
    load_at(3.0); /* out of sight; the step clears the contact forces */
    step();
    view_frame(view, sim, &info);
    memcpy(empty, view_pixels(view), bytes);
    load_at(0.01);
    for (int i = 0; i < 250; i++) {
        step();
        if (i % 5 == 0) {
            view_observe(view, sim);
        }
    }
    view_frame(view, sim, &info);
    memcpy(standing, view_pixels(view), bytes);
    load_at(3.0);
    step();
    view_frame(view, sim, &info);
    int robot_pixels = pixels_different(empty, standing, bytes),
        prints = pixels_different(empty, view_pixels(view), bytes);
    print_message("robot changes %d samples of %zu, its prints %d\n", robot_pixels, bytes, prints);
    assert_true(robot_pixels > 1000);
    assert_true(prints > 20 && prints < robot_pixels);
    assert_int_equal(view_reset(view, &terrain, &error), MILD_OK);
    view_frame(view, sim, &info);
    memcpy(standing, view_pixels(view), bytes);
    info.note = "friction 0.60";
    view_frame(view, sim, &info);
    const size_t half = bytes / 2; /* rows from the top: the note is in the lower half */
    assert_true(pixels_different(standing + half, view_pixels(view) + half, half) > 100);
    assert_true(pixels_different(standing, view_pixels(view), half) < 100);
    info.note = NULL;
    view_frame(view, sim, &info);
    assert_true(pixels_different(empty, view_pixels(view), bytes) < prints / 4);
    free(empty);
    free(standing);
    view_destroy(view);
}

/* Another robot is drawn where its place says, with its imprints, which stay in sand; and not where
 * it is behind the camera. The robot itself is out of sight. */
TEST(others_are_seen) {
    const size_t bytes = (size_t)240 * 136 * 3;
    MildError error = {0};
    ViewDef def = view_def_default();
    ViewOther other = {.place = {100, -100}};
    ViewInfo info = {.others = &other};
    def.width = 240, def.height = 136;
    def.names = names;
    def.closeup = 0, def.force_arrow = 0;
    def.away_distance = 8, def.away_elevation = -40;
    def.x_max = 0.5; /* no imprint on the other side */
    def.others = 1;
    View *view = view_create(&def, robot, &terrain, &error);
    if (!view) {
        assert_error(&error, MILD_ERROR_IO, "apt-get");
        skip();
    }
    const RobotState stands = stand_state(stand, 1, 0.0);
    memcpy(other.qpos, stands.qpos, sizeof other.qpos);
    for (int f = 0; f < SA01_FEET; f++) {
        other.position[f][2] = VIEW_NOWHERE;
        other.rotation[f][0] = other.rotation[f][4] = other.rotation[f][8] = 1;
    }
    unsigned char *empty = malloc(bytes);
    load_at(3.0);
    step();
    view_frame(view, sim, &info);
    memcpy(empty, view_pixels(view), bytes);
    other.place[0] = -1, other.place[1] = 1.5;
    view_frame(view, sim, &info);
    const int robot_pixels = pixels_different(empty, view_pixels(view), bytes);
    for (int f = 0; f < SA01_FEET; f++) { /* 40 mm deep, and away again */
        other.position[f][1] = f == SA01_LEFT ? 0.1 : -0.1;
        other.position[f][2] = 0.015;
    }
    view_frame(view, sim, &info);
    other.place[0] = 100, other.place[1] = -100;
    view_frame(view, sim, &info);
    const int prints = pixels_different(empty, view_pixels(view), bytes);
    print_message("another robot changes %d samples of %zu, its prints %d\n", robot_pixels, bytes,
                  prints);
    assert_true(robot_pixels > 600);
    assert_true(prints > 20 && prints < robot_pixels);
    info.away = 1; /* the camera goes up and back */
    view_frame(view, sim, &info);
    assert_true(pixels_different(empty, view_pixels(view), bytes) > 5000);
    free(empty);
    view_destroy(view);
}

TEST(bad_size_is_one_line) {
    MildError error = {0};
    ViewDef def = view_def_default();
    def.width = 8;
    assert_null(view_create(&def, robot, &terrain, &error));
    assert_int_equal(error.status, MILD_ERROR_RANGE);
}

static int skies(const char *xml) {
    MildError error = {0};
    const ReliefDef def = {
        .cell = 0.02, .x_min = -1, .x_max = 1, .y_min = -1, .y_max = 1, .robots = 1};
    const int size[2] = {320, 240};
    const Surfaces surfaces = {2, 5};
    Relief *relief = relief_create(&def, &terrain, robot_soles(robot), SA01_FEET, &error);
    assert_non_null(relief);
    mjModel *model = view_model(xml, NULL, size, relief, &surfaces, &error);
    assert_non_null(model);
    int count = 0;
    for (int i = 0; i < model->ntex; i++) {
        count += model->tex_type[i] == mjTEXTURE_SKYBOX;
    }
    assert_int_equal(model->nskin, 5);
    assert_true(model->skin_vertnum[1] < model->skin_vertnum[2]);
    assert_true(mj_name2id(model, mjOBJ_MATERIAL, "view_tile_4") >= 0);
    mj_deleteModel(model);
    relief_destroy(relief);
    return count;
}

/* One, of the file or ours. */
TEST(every_robot_has_a_sky) {
    char path[] = "/tmp/mild_sky_XXXXXX";
    FILE *file = fdopen(mkstemp(path), "w");
    assert_non_null(file);
    fputs("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>", file);
    fclose(file);
    assert_int_equal(skies(path), 1);
    assert_int_equal(skies(robot_model_path(robot)), 1);
    unlink(path);
}

/* Mean pressure times area over a stance is the mean force of that stance. */
TEST(pressure_carries_the_weight) {
    MildError error = {0};
    Pressure *pressure = pressure_create(robot, 1, DT, &error);
    assert_non_null(pressure);
    load_at(0.001);
    double force = 0;
    int samples = 0;
    for (int i = 0; i < 400; i++) {
        step();
        pressure_observe(pressure, sim, &terrain);
        double now = 0;
        const double *normal = mild_scratch_elements(robot_sim_scratch(sim), 0).normal;
        for (int e = 0; e < mild_sole_elements(robot_soles(robot)[0]); e++) {
            now += normal[e];
        }
        if (now >= 20) {
            force += now, samples++;
        }
    }
    assert_int_equal(pressure_stances(pressure, 0), 0); /* still standing */
    load_at(0.3);
    step();
    pressure_observe(pressure, sim, &terrain);
    assert_int_equal(pressure_stances(pressure, 0), SA01_FEET);

    char path[] = "/tmp/mild_pressure_XXXXXX", line[200];
    close(mkstemp(path));
    assert_int_equal(pressure_write(pressure, path, names, &error), MILD_OK);
    FILE *file = fopen(path, "r");
    double sum = 0, pitch = mild_sole_pitch(robot_soles(robot)[0]);
    int elements = 0, points = 0;
    assert_non_null(fgets(line, sizeof line, file));
    assert_string_equal(line, "ground,foot,what,index,x_m,y_m,mean_kpa,peak_kpa\n");
    while (fgets(line, sizeof line, file)) {
        int index;
        double x, y, mean, peak;
        if (sscanf(line, "sand_loose,left,element,%d,%lf,%lf,%lf,%lf", &index, &x, &y, &mean,
                   &peak) == 5) {
            assert_true(peak >= mean - 1e-3);
            sum += 1e3 * mean * pitch * pitch;
            elements++;
        }
        points += strstr(line, "left,path") != NULL;
    }
    fclose(file);
    unlink(path);
    print_message("left foot: mean force %.2f N in the CSV, %.2f N in the steps\n", sum,
                  force / samples);
    assert_int_equal(elements, mild_sole_elements(robot_soles(robot)[0]));
    assert_int_equal(points, PRESSURE_PATH);
    assert_true(fabs(sum - force / samples) < 1e-3 * sum);
    pressure_destroy(pressure);
}

TEST_MAIN(setup, teardown)
