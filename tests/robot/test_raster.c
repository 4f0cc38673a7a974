/* Coarser rasters: area, centroid and second moments of area are those of the robot's own raster,
 * so a linear bed would answer with the same force and moment; and what is refused. */
#include "all_robots.h"

enum { COUNTS = 4 };
static const int counts[COUNTS] = {77, 38, 20, 10}; /* of a foot of SA01 */

/* ---- equal moments ---- */

/* Integrals over the sole: 1, x, y, x^2, x y, y^2 about the ankle [m^2, m^3, m^4]. */
enum { INTEGRALS = 6 };
static void integrate(const MildSole *sole, double sum[INTEGRALS]) {
    const double area = mild_sole_pitch(sole) * mild_sole_pitch(sole);
    memset(sum, 0, INTEGRALS * sizeof *sum);
    for (int i = 0; i < mild_sole_elements(sole); i++) {
        const double x = mild_sole_x(sole)[i], y = mild_sole_y(sole)[i];
        const double each[INTEGRALS] = {1, x, y, x * x, x * y, y * y};
        for (int k = 0; k < INTEGRALS; k++) {
            sum[k] += area * each[k];
        }
    }
}

/* The integrals of both, each relative to the largest that its lengths could make. */
static void expect_integrals(const MildSole *sole, const MildSole *own) {
    double got[INTEGRALS], wanted[INTEGRALS];
    integrate(sole, got);
    integrate(own, wanted);
    const double x = sqrt(wanted[3] / wanted[0]), y = sqrt(wanted[5] / wanted[0]);
    const double size[INTEGRALS] = {1, x, y, x * x, x * y, y * y};
    for (int k = 0; k < INTEGRALS; k++) {
        expect_entry("integral", k, got[k], wanted[k], 1e-12 * wanted[0] * size[k]);
    }
}

TEST(moments_are_those_of_the_own) {
    Robot *robot = robots[0];
    for (int c = 0; c < COUNTS; c++) {
        assert_int_equal(robot_set_elements(robot, counts[c], NULL), MILD_OK);
        for (int f = 0; f < robot_feet(robot); f++) {
            assert_int_equal(mild_sole_elements(robot_soles(robot)[f]), counts[c]);
            expect_integrals(robot_soles(robot)[f], robot_rasters(robot)[f]);
        }
    }
    /* the robot's own count is its own raster, and so is 0 */
    for (int k = 0; k < 2; k++) {
        assert_int_equal(robot_set_elements(robot, k ? 0 : 77, NULL), MILD_OK);
        assert_ptr_equal(robot_soles(robot)[1], robot_rasters(robot)[1]);
    }
}

/* The elements cover the sole: none is further than a cell from one of the own raster, and the
 * right foot is the mirror image of the left. */
TEST(elements_cover_the_sole) {
    Robot *robot = robots[0];
    for (int c = 0; c < COUNTS; c++) {
        assert_int_equal(robot_set_elements(robot, counts[c], NULL), MILD_OK);
        const MildSole *left = robot_soles(robot)[0], *right = robot_soles(robot)[1];
        const MildSole *own = robot_rasters(robot)[0];
        double apart = 0, mirrored = 0;
        for (int i = 0; i < counts[c]; i++) {
            const double x = mild_sole_x(left)[i], y = mild_sole_y(left)[i];
            double nearest = 1, image = 1;
            for (int k = 0; k < 77; k++) {
                nearest = fmin(nearest, hypot(mild_sole_x(own)[k] - x, mild_sole_y(own)[k] - y));
            }
            for (int k = 0; k < counts[c]; k++) {
                image = fmin(image, hypot(mild_sole_x(right)[k] - x, mild_sole_y(right)[k] + y));
            }
            apart = fmax(apart, nearest);
            mirrored = fmax(mirrored, image);
        }
        expect_entry("from the own", c, apart, 0, 0.71 * 0.0195);
        expect_entry("mirrored", c, mirrored, 0, 1e-12);
    }
    robot_set_elements(robot, 0, NULL);
}

/* ---- what is refused ---- */

static void refuse(int robot, int elements, MildStatus status, const char *named) {
    MildError error = {0};
    const MildSole *before = robot_soles(robots[robot])[0];
    assert_int_equal(robot_set_elements(robots[robot], elements, &error), status);
    assert_error(&error, status, named);
    assert_ptr_equal(robot_soles(robots[robot])[0], before);
}

TEST(nonsense_is_refused) {
    refuse(0, 78, MILD_ERROR_RANGE, "foot.left 77");
    refuse(0, -1, MILD_ERROR_RANGE, "foot.left 77");
    refuse(0, 1, MILD_ERROR_RANGE, "foot.left 77");
    refuse(0, 4, MILD_ERROR_RANGE, "foot.left 77");
    refuse(1, 3, MILD_ERROR_ARGUMENT, "foot.FL round");
    robot_set_model(robots[0], MILD_MODEL_CON_SPRING);
    refuse(0, 20, MILD_ERROR_ARGUMENT, "model one element");
    assert_int_equal(robot_set_elements(robots[0], 0, NULL), MILD_OK);
    robot_set_model(robots[0], MILD_MODEL_MILD);
}

TEST_MAIN(open_robots, close_robots)
