/* The picture in characters: where the surface, an imprint and the robot are, by the dots. */
#include "robots.h"
#include "sa01.h"
#include "view/sketch.h"

#define COLUMNS 60
#define ROWS 20
#define DOTS 40.0 /* [1/m] */
#define BELOW 0.3 /* [m] */
#define HEIGHT 0.9
#define CENTER (2 * COLUMNS * 3 / 10) /* 36: column of the base */

static Robot *robot;
static RobotSim *sim;
static Sketch *sketch;
static int dot[4 * ROWS][2 * COLUMNS]; /* bool; first row on top */

static int teardown(void **state) {
    (void)state;
    sketch_destroy(sketch);
    robot_sim_destroy(sim);
    robot_destroy(robot);
    return 0;
}

static int setup(void **state) {
    (void)state;
    MildError error = {0};
    MildMaterial sand;
    robot = kit_robot(SA01);
    sim = robot_sim_create(robot, 0.002, &error);
    assert_non_null(sim);
    assert_true(mild_material_preset("sand_loose", &sand));
    const MildTerrain terrain = mild_terrain_uniform(&sand);
    SketchDef def = sketch_def_default();
    def.columns = COLUMNS, def.rows = ROWS, def.dots = DOTS, def.depth = BELOW;
    sketch = sketch_create(&def, robot, &terrain, &error);
    assert_non_null(sketch);
    assert_int_equal(sketch_rows(sketch), ROWS);
    return 0;
}

/* Upright, its base there. */
static void put(double x, double height) {
    const RobotVariation nominal = robot_variation_nominal();
    RobotState start = {.qpos = {x, 0, height, 1, 0, 0, 0}};
    memcpy(start.qpos + 7, robot_default_pose(robot), SA01_JOINTS * sizeof *start.qpos);
    robot_sim_load(sim, &start, &nominal);
}

/* [m] Of the lower sole. */
static double sole_height(void) {
    return fmin(robot_sim_foot(sim, 0)->sole_height, robot_sim_foot(sim, 1)->sole_height);
}

/* Reads the characters: U+2800 and eight bits, of two columns of three dots, then of the fourth
 * row. */
static void draw(void) {
    const unsigned char *text = (const unsigned char *)sketch_draw(sketch, sim);
    assert_int_equal(strlen((const char *)text), ROWS * (3 * COLUMNS + 1));
    for (int row = 0; row < ROWS; row++) {
        for (int column = 0; column < COLUMNS; column++, text += 3) {
            const unsigned code =
                (text[0] & 0xfu) << 12 | (text[1] & 0x3fu) << 6 | (text[2] & 0x3fu);
            assert_true(code >= 0x2800 && code <= 0x28ff);
            for (int k = 0; k < 8; k++) {
                const int down = k < 6 ? k % 3 : 3, right = k < 6 ? k / 3 : k - 6;
                dot[4 * row + down][2 * column + right] = code >> k & 1;
            }
        }
        assert_int_equal(*text++, '\n');
    }
}

/* Row of a height [m]. */
static int row_of(double height) {
    return 4 * ROWS - 1 - (int)floor((height + BELOW) * DOTS);
}

static int top_of(int column) {
    int row = 0;
    while (row < 4 * ROWS && !dot[row][column]) {
        row++;
    }
    return row;
}

TEST_WITH(surface_and_robot, setup, teardown) {
    put(0, HEIGHT);
    draw();
    const int surface = row_of(0);
    int lowest = 0, widest = 0;
    for (int column = 0; column < 2 * COLUMNS; column++) {
        assert_true(dot[surface][column]); /* an unbroken line */
        const int top = top_of(column);
        if (abs(column - CENTER) > 0.3 * DOTS) { /* nothing but ground so far from the robot */
            assert_int_equal(top, surface);
        }
        widest += top < surface;
        for (int row = 0; row < surface; row++) {
            lowest = dot[row][column] && row > lowest ? row : lowest;
        }
    }
    assert_int_equal(lowest, row_of(sole_height()));
    assert_true(top_of(CENTER) < row_of(HEIGHT) && top_of(CENTER) > row_of(HEIGHT + 0.5));
    assert_true(widest > 0.2 * DOTS && widest < 0.6 * DOTS);
    int grains = 0;
    for (int row = surface + 1; row < 4 * ROWS; row++) {
        for (int column = 0; column < 2 * COLUMNS; column++) {
            grains += dot[row][column];
        }
    }
    const int below = (4 * ROWS - surface - 1) * 2 * COLUMNS;
    assert_true(grains > below / 32 && grains < below / 8); /* one in 16 */
}

/* A foot presses, the robot goes away: the surface stays down there, as deep as the sole was. */
TEST_WITH(imprint, setup, teardown) {
    const double depth = 0.1;
    put(0, HEIGHT);
    put(0, HEIGHT - sole_height() - depth);
    sketch_observe(sketch, sim);
    put(0.5, HEIGHT);
    draw();
    const int column = CENTER - (int)(0.5 * DOTS); /* where it pressed */
    assert_true(abs(top_of(column) - row_of(-depth)) <= 1);
    assert_int_equal(top_of(CENTER + (int)DOTS), row_of(0));
    put(0.75, HEIGHT); /* the picture goes with the robot, the ground does not */
    draw();
    assert_true(abs(top_of(column - (int)(0.25 * DOTS)) - row_of(-depth)) <= 1);
}

TEST_MAIN(NULL, NULL)
