/* The quadruped robots/go1 against the published numbers of go1.json: its geometry by hand, and the
 * stand controller on every ground. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#define MODEL MILD_SOURCE_DIR "/robots/go1"
#include "numbers.h"
#include "stand_kit.h"

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
    RobotState state = stand_state(stand, 0, 0.0);
    RobotVariation nominal = robot_variation_nominal();
    robot_sim_load(sim, &state, &nominal);
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

/* ---- standing ---- */

static int is_up(const RobotSim *sim, const MildTerrain *terrain) {
    return kit_tilt(robot_sim_base_rotation(sim)) < 0.5 &&
           robot_sim_base_clearance(sim, terrain) > 0;
}

/* Four seconds; a push [N] for 0.1 s after the first. material: NULL for rigid ground. */
static void check(const char *name, const MildMaterial *material, double dt, const double push[6]) {
    KitStand how = {.material = material, .dt = dt, .seconds = 4, .tail = 1, .up = is_up};
    memcpy(how.push, push, sizeof how.push);
    const Standing r = kit_stand(&how);
    const double depth = material ? r.depth : 0;
    print_message("%-11s %.1f ms push %3.0f %3.0f N %s load %.5f, least foot %.2f, depth %5.1f of "
                  "%5.1f mm, moved %4.1f mm, tilt %.4f rad, still %.4f\n",
                  name, 1e3 * dt, push[0], push[1], r.stands ? "stands" : "FELL  ", r.load, r.share,
                  1e3 * depth, 1e3 * r.rest, 1e3 * r.moved, r.tilt, r.speed);
    assert_true(r.stands);
    expect_near("load", r.load, 1, 0.01);
    assert_true(r.share > 0.5);
    assert_true(r.tilt < 0.1);
    assert_true(r.speed < 0.3); /* still swaying after the push */
    expect_near("height", r.height + depth, robot_stand_height(robot), 0.01);
    if (push[0] != 0 || push[1] != 0) {
        assert_true(r.moved > 2e-3);
    } else if (material) {
        assert_true(fabs(depth - r.rest) < 0.15 * r.rest);
    }
}

TEST(stands_and_is_pushed_everywhere) {
    static const double pushes[3][6] = {{0}, {40, 0}, {0, 25}};
    for (int p = 0; p < 3; p++) {
        check("rigid", NULL, 0.001, pushes[p]);
        for (int g = 0; g < mild_material_preset_count(); g++) {
            MildMaterial material = kit_preset(mild_material_preset_name(g));
            check(mild_material_preset_name(g), &material, p == 0 ? 0.0025 : 0.001, pushes[p]);
        }
    }
}

TEST_MAIN(open_numbers, close_numbers)
