/* The quadruped robots/go1 against the published numbers of go1.json: its geometry by hand, four
 * round feet, and the stand controller on every ground. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define MODEL MILD_SOURCE_DIR "/robots/go1"
#include "numbers.h"
#include "stand_kit.h"

#include <mujoco/mujoco.h>

#include "mild/map.h"

enum { FEET = 4, JOINTS = 12, NV = 18, FL = 0, FR = 1, RL = 2, RR = 3 };

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

/* With `from` written as `to` in robot.ini. */
static Robot *changed_robot(const char *from, const char *to, MildError *error) {
    return kit_robot_changed(MODEL, "go1.xml", "robot.ini", from, to, error);
}

TEST(what_may_be_left_out) {
    MildError error = {0};
    Robot *changed = changed_robot("stand_kp    =", "# a remark\n; stand_kp    =", &error);
    expect_good(changed != NULL, &error);
    for (int i = 0; i < JOINTS; i++) {
        expect_near("stand_kp without a list", robot_stand_kp(changed)[i], robot_kp(robot)[i], 0);
        expect_near("stand_kd", robot_stand_kd(changed)[i], robot_stand_kd(robot)[i], 0);
    }
    robot_destroy(changed);
    changed = changed_robot("height = 0.28            ;", "height = 0.28            #", &error);
    expect_good(changed != NULL, &error);
    expect_near("height", robot_nominal_height(changed), 0.28, 0);
    robot_destroy(changed);
    static const struct {
        const char *from, *to;
        MildStatus status;
        const char *names;
    } refused[] = {
        {"center = 0 0 -0.213", "", MILD_ERROR_FORMAT, "robot.ini [foot.FL] center"},
        {"radius = 0.023", "", MILD_ERROR_FORMAT, "robot.ini [foot.FL] radius"},
        {"shape = round", "shape = round\nz = -0.2", MILD_ERROR_FORMAT, "robot.ini [foot.FL] z"},
        {"shape = round", "shape = ball", MILD_ERROR_ARGUMENT, "foot.FL.shape ball round"},
        {"body = FR_calf", "body = FL_calf", MILD_ERROR_FORMAT, "FL FR body"},
        {"offset = 0\n", "", MILD_ERROR_FORMAT, "robot.ini [foot.FL] offset"},
        {"center = 0 0 -0.213\nradius = 0.023", "center = 0 0 -0.06\nradius = 0.2",
         MILD_ERROR_FORMAT, "FL_calf_upper shells covers FL"}};
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        assert_null(changed_robot(refused[i].from, refused[i].to, &error));
        print_message("%s\n", error.text);
        assert_error(&error, refused[i].status, refused[i].names);
    }
}

/* ---- round feet ---- */

/* Turned, bent and in motion. */
static RobotState moving_state(uint32_t draw) {
    Random r = random_at(5, draw, 0);
    RobotState state = stand_state(stand, 0, 0.0);
    double turn[4] = {1, random_uniform(&r, -0.15, 0.15), random_uniform(&r, -0.15, 0.15),
                      random_uniform(&r, -1, 1)};
    mju_normalize4(turn);
    memcpy(state.qpos + 3, turn, sizeof turn);
    for (int i = 0; i < JOINTS; i++) {
        state.qpos[7 + i] += random_uniform(&r, -0.2, 0.2);
    }
    for (int i = 0; i < NV; i++) {
        state.qvel[i] = random_uniform(&r, -0.5, 0.5);
    }
    return state;
}

/* The lowest point of the sphere, and its Jacobian as a point of the calf: the engine's own. */
static void lowest_point(RobotSim *sim, int foot, double point[3], double jacobian[3 * NV]) {
    const mjModel *m = robot_sim_model(sim);
    const mjData *d = robot_sim_data(sim);
    static const char *const calves[FEET] = {"FL_calf", "FR_calf", "RL_calf", "RR_calf"};
    int body = mj_name2id(m, mjOBJ_BODY, calves[foot]);
    const double *turn = d->xmat + 9 * body;
    for (int k = 0; k < 3; k++) {
        point[k] = d->xpos[3 * body + k] - leg * turn[3 * k + 2];
    }
    point[2] -= foot_radius;
    mj_jac(m, d, jacobian, NULL, point, body);
}

/* [m] How far heights are off above the rough ground under each foot, which is drawn lower. */
static double height_error(RobotSim *sim, const MildTerrain *low) {
    double worst = 0;
    double clearance = robot_sim_sole_clearance(sim, low), least = 1e9;
    for (int f = 0; f < FEET; f++) {
        const double *at = robot_sim_foot(sim, f)->position;
        const double height = at[2] - mild_terrain_height_at(low, at[0], at[1]);
        worst = fmax(worst, fabs(robot_sim_foot(sim, f)->sole_height - height));
        least = fmin(least, height);
    }
    return fmax(worst, fabs(clearance - least));
}

/* How far the lowest points of the feet are off, [m] and [m/s]; their Jacobians. */
static void position_errors(RobotSim *sim, const RobotState *state, double jacobian[FEET][3 * NV],
                            double *worst_position, double *worst_speed) {
    for (int f = 0; f < FEET; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        double point[3], speed[3];
        lowest_point(sim, f, point, jacobian[f]);
        mju_mulMatVec(speed, jacobian[f], state->qvel, 3, NV);
        for (int k = 0; k < 3; k++) {
            *worst_position = fmax(*worst_position, fabs(point[k] - foot->position[k]));
            *worst_speed = fmax(*worst_speed, fabs(speed[k] - foot->velocity[k]));
            *worst_speed = fmax(*worst_speed, fabs(foot->velocity[3 + k]));
        }
    }
}

/* Place and speed of the foot, and after a step: acceleration = M^-1 (tau - b + J^T F), with no
 * moment. */
TEST(a_round_foot_is_a_point) {
    RobotSim *sim = new_sim(0.0005);
    MildGround *ground = kit_ground(robot);
    MildMaterial sand = mild_material_default();
    MildTerrain terrain = mild_terrain_uniform(&sand);
    MildMapDef rough = mild_map_def_default(); /* the disc is not loaded evenly */
    MildError error = {0};
    rough.kind = MILD_MAP_ROUGH;
    MildMap *map = mild_map_create(&rough, &error);
    assert_non_null(map);
    assert_int_equal(mild_terrain_set_map(&terrain, map, &error), MILD_OK);
    RobotVariation nominal = robot_variation_nominal();
    MildTerrain low = terrain;
    low.height = -0.3;
    double worst_position = 0, worst_speed = 0, worst_step = 0, worst_height = 0, largest = 0;
    for (uint32_t draw = 0; draw < 20; draw++) {
        RobotState state = moving_state(draw);
        double torque[JOINTS], jacobian[FEET][3 * NV], force[NV] = {0}, rate[NV];
        robot_sim_load(sim, &state, &nominal);
        position_errors(sim, &state, jacobian, &worst_position, &worst_speed);
        worst_height = fmax(worst_height, height_error(sim, &low));
        const mjModel *m = robot_sim_model(sim);
        mjData *d = mj_makeData(m);
        robot_engine_qpos(robot, state.qpos, d->qpos);
        memcpy(d->qvel, state.qvel, sizeof state.qvel[0] * NV);
        mj_fwdPosition(m, d);
        mj_fwdVelocity(m, d);
        stand_torque(stand, sim, 0, torque);
        mild_ground_reset(ground);
        assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
        for (int k = 0; k < NV; k++) {
            force[k] = (k >= 6 ? torque[k - 6] : 0) - d->qfrc_bias[k];
        }
        for (int f = 0; f < FEET; f++) {
            const RobotFoot *foot = robot_sim_foot(sim, f);
            double pulled[NV];
            mju_mulMatTVec(pulled, jacobian[f], foot->force, 3, NV);
            mju_addTo(force, pulled, NV);
            largest = fmax(largest, foot->force[2]);
            for (int k = 0; k < 3; k++) {
                assert_true(foot->torque[k] == 0);
            }
        }
        mj_solveM(m, d, rate, force, 1);
        for (int k = 0; k < NV; k++) {
            double change = (robot_sim_qvel(sim)[k] - state.qvel[k]) / robot_sim_dt(sim);
            worst_step = fmax(worst_step, fabs(change - rate[k]));
        }
        mj_deleteData(d);
    }
    print_message(
        "lowest points off by %.1e m, %.1e m/s, %.1e m of height; accelerations by %.1e under "
        "%.0f N\n",
        worst_position, worst_speed, worst_height, worst_step, largest);
    assert_true(worst_position < 1e-12 && worst_speed < 1e-12 && worst_step < 1e-8);
    assert_true(worst_height < 1e-12);
    assert_true(largest > 5);
    mild_map_destroy(map);
    free(ground);
    robot_sim_destroy(sim);
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
