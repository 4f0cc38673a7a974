/* The quadruped robots/go1 against the published numbers of go1.json: its geometry by hand. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#define MODEL MILD_SOURCE_DIR "/robots/go1"
#include "numbers.h"
#include "robot_kit.h"

enum { FEET = 4, JOINTS = 12, FL = 0, FR = 1, RL = 2, RR = 3 };

/* The published numbers. */
static double hip_x, hip_y;           /* [m] hip roll axis from the trunk's centre */
static double roll_offset;            /* [m] thigh from the hip roll axis */
static double leg;                    /* [m] thigh, and knee to the foot's centre */
static double foot_radius;            /* [m] */
static double mass, weight;           /* [kg] trunk, four hips, thighs, calves; [N] */
static double effort[3], speed_of[3]; /* [N m] [rad/s] hip, thigh, knee */

static int open_numbers(void **state) {
    numbers_open(MODEL "/go1.json");
    const cJSON *links = item(numbers, "links");
    assert_int_equal(cJSON_GetArraySize(links), 3);
    double at[3][3], foot[3];
    mass = number(item(numbers, "trunk"), "mass");
    for (int i = 0; i < 3; i++) {
        const cJSON *link = cJSON_GetArrayItem(links, i);
        vector(link, "position", 3, at[i]);
        mass += FEET * number(link, "mass");
        effort[i] = number(link, "effort");
        speed_of[i] = number(link, "speed");
    }
    vector(item(numbers, "foot"), "position", 3, foot);
    assert_true(foot[2] == at[2][2]); /* thigh and shank are of one length */
    hip_x = at[0][0];
    hip_y = at[0][1];
    roll_offset = at[1][1];
    leg = -at[2][2];
    foot_radius = number(item(numbers, "foot"), "radius");
    weight = 9.81 * mass;
    return setup(state);
}

static int close_numbers(void **state) {
    numbers_close();
    return teardown(state);
}

/* ---- the folder ---- */

/* Where the feet are in the default pose: hip roll a = -0.1 (left), thigh 0.9, knee -1.8. */
TEST(the_pose_by_hand) {
    const double a = 0.1, length = 2 * leg * cos(0.9);
    const double height = length * cos(a) + roll_offset * sin(a) + foot_radius;
    const double y = hip_y + roll_offset * cos(a) - length * sin(a), x = hip_x;
    const double side[FEET] = {1, -1, 1, -1}, front[FEET] = {1, 1, -1, -1};
    assert_int_equal(robot_joints(robot), JOINTS);
    assert_int_equal(robot_feet(robot), FEET);
    assert_int_equal(robot_points(robot), 1);
    expect_near("mass", robot_total_mass(robot), mass, 1e-9);
    expect_near("load of a foot", robot_foot_load(robot), weight / FEET, 1e-6);
    expect_near("height", robot_stand_height(robot), height, 1e-9);
    RobotSim *sim = new_sim(0.001);
    for (int f = 0; f < FEET; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        expect_near("foot's x", foot->position[0], front[f] * x, 1e-9);
        expect_near("foot's y", foot->position[1], side[f] * y, 1e-9);
        expect_near("foot's z", foot->position[2], 0, 1e-9);
    }
    expect_near("feet apart", robot_sim_foot_distance(sim), 2 * y, 1e-9);
    /* the lower of a calf's capsules, of radius 0.01, is the lowest shell. From the middle of the
     * foot's ball, in the calf's frame, its axis is (0, 0, 0.013) + s u with u along (0.016, 0,
     * 0.08); it is cut off where the two touch. */
    const double ux = 0.016 / hypot(0.016, 0.08), uz = 0.08 / hypot(0.016, 0.08);
    const double far = foot_radius + 0.01;
    const double s = -0.013 * uz + sqrt(far * far - 0.013 * 0.013 * ux * ux);
    const double rise = sin(0.9) * s * ux + cos(0.9) * (0.013 + s * uz);
    MildMaterial any = mild_material_default();
    MildTerrain level = mild_terrain_uniform(&any);
    expect_near("clearance", robot_sim_body_clearance(sim, &level),
                foot_radius + rise * cos(a) - 0.01, 1e-9);
    robot_sim_destroy(sim);
}

TEST(efforts_speeds_and_gait) {
    for (int i = 0; i < JOINTS; i++) {
        expect_near("effort", robot_effort(robot)[i], effort[i % 3], 1e-9);
        expect_near("speed", robot_speed(robot)[i], speed_of[i % 3], 1e-9);
        assert_int_equal(robot_joint_foot(robot)[i], i / 3);
    }
    /* a trot: diagonal feet together, mirrored feet alternate */
    assert_true(robot_table(robot)->gait_offset[FL] == robot_table(robot)->gait_offset[RR]);
    assert_true(robot_table(robot)->gait_offset[FR] == robot_table(robot)->gait_offset[RL]);
    expect_near("shift",
                fabs(robot_table(robot)->gait_offset[FL] - robot_table(robot)->gait_offset[FR]),
                0.5, 0);
}

TEST_MAIN(open_numbers, close_numbers)
