/* The biped robots/g1 against the published numbers of g1.json: its fixed upper body by hand, and
 * its geometry. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#define MODEL MILD_SOURCE_DIR "/robots/g1"
#include "numbers.h"
#include "robot_kit.h"

#include <mujoco/mujoco.h>

enum { FEET = 2, JOINTS = 12, LEG = 6 };

/* ---- the upper body ---- */

/* A body of the published MJCF that is now part of the pelvis. */
typedef struct {
    int parent;
    double position[3], quaternion[4]; /* [m], in the parent */
    int axis;                          /* of the joint that is fixed */
    double angle;                      /* [rad] it is fixed at */
    double mass;                       /* [kg] */
    double center[3], turn[4];         /* [m] of the inertia, in the body */
    double inertia[3];                 /* [kg m^2] */
} Part;

enum { PARTS = 18 };
static Part parts[PARTS];

/* A link of the left leg. */
typedef struct {
    double position[3], mass, effort, speed;
} Link;
static Link links[LEG];

/* Which of the first `count` parts has the name; -1: none. */
static int part_named(const cJSON *name, int count) {
    const cJSON *rows = item(numbers, "parts");
    for (int p = 0; p < count; p++) {
        if (cJSON_Compare(item(cJSON_GetArrayItem(rows, p), "name"), name, 1)) {
            return p;
        }
    }
    assert_true(cJSON_IsNull(name));
    return -1;
}

static void read_part(int p, const cJSON *row) {
    Part *part = &parts[p];
    part->parent = part_named(item(row, "parent"), p);
    part->axis = word(row, "axis")[0] - 'x';
    part->angle = number(row, "angle");
    part->mass = number(row, "mass");
    vector(row, "position", 3, part->position);
    vector(row, "quaternion", 4, part->quaternion);
    vector(row, "center", 3, part->center);
    vector(row, "turn", 4, part->turn);
    vector(row, "inertia", 3, part->inertia);
}

static int open_numbers(void **state) {
    numbers_open(MODEL "/g1.json");
    const cJSON *rows = item(numbers, "parts"), *leg = item(numbers, "links");
    assert_int_equal(cJSON_GetArraySize(rows), PARTS);
    assert_int_equal(cJSON_GetArraySize(leg), LEG);
    for (int p = 0; p < PARTS; p++) {
        read_part(p, cJSON_GetArrayItem(rows, p));
    }
    for (int i = 0; i < LEG; i++) {
        const cJSON *link = cJSON_GetArrayItem(leg, i);
        vector(link, "position", 3, links[i].position);
        links[i].mass = number(link, "mass");
        links[i].effort = number(link, "effort");
        links[i].speed = number(link, "speed");
    }
    return setup(state);
}

static int close_numbers(void **state) {
    numbers_close();
    return teardown(state);
}

/* Frames of the parts in the pelvis. */
static void parts_places(double position[PARTS][3], double quaternion[PARTS][4]) {
    for (int p = 0; p < PARTS; p++) {
        const Part *part = &parts[p];
        double joint[4] = {cos(0.5 * part->angle), 0, 0, 0}, body[4];
        joint[1 + part->axis] = sin(0.5 * part->angle);
        memcpy(body, part->quaternion, sizeof body);
        mju_normalize4(body);
        mju_mulQuat(quaternion[p], body, joint);
        memcpy(position[p], part->position, sizeof part->position);
        if (part->parent >= 0) {
            double own[4];
            memcpy(own, quaternion[p], sizeof own);
            mju_mulQuat(quaternion[p], quaternion[part->parent], own);
            mju_rotVecQuat(position[p], part->position, quaternion[part->parent]);
            mju_addTo3(position[p], position[part->parent]);
        }
    }
}

/* Adds R diag(inertia) R^T + mass (|c|^2 1 - c c^T). */
static void add_inertia(double tensor[9], const double turn[4], const double inertia[3],
                        double mass, const double c[3]) {
    double R[9];
    mju_quat2Mat(R, turn);
    for (int e = 0; e < 9; e++) {
        const int i = e / 3, j = e % 3;
        for (int k = 0; k < 3; k++) {
            tensor[e] += R[3 * i + k] * inertia[k] * R[3 * j + k];
        }
        tensor[e] += mass * ((i == j) * mju_dot3(c, c) - c[i] * c[j]);
    }
}

/* Mass, centre and inertia of the base against the sums over the published bodies. */
TEST(the_upper_body_by_hand) {
    double position[PARTS][3], quaternion[PARTS][4], mass = 0, center[3] = {0}, sum[9] = {0};
    parts_places(position, quaternion);
    double at[PARTS][3];
    for (int p = 0; p < PARTS; p++) {
        mju_rotVecQuat(at[p], parts[p].center, quaternion[p]);
        mju_addTo3(at[p], position[p]);
        mju_addToScl3(center, at[p], parts[p].mass);
        mass += parts[p].mass;
    }
    mju_scl3(center, center, 1 / mass);
    for (int p = 0; p < PARTS; p++) {
        double own[4], turn[4], c[3];
        memcpy(own, parts[p].turn, sizeof own);
        mju_normalize4(own);
        mju_mulQuat(turn, quaternion[p], own);
        mju_sub3(c, at[p], center);
        add_inertia(sum, turn, parts[p].inertia, parts[p].mass, c);
    }
    RobotSim *sim = new_sim(0.001);
    const mjModel *m = robot_sim_model(sim);
    const int base = mj_name2id(m, mjOBJ_BODY, "pelvis");
    double got[9] = {0};
    const double none[3] = {0};
    add_inertia(got, m->body_iquat + 4 * base, m->body_inertia + 3 * base, 0, none);
    assert_int_equal(m->nbody, 2 + JOINTS); /* the world, the base, the links */
    expect_near("mass of the base", m->body_mass[base], mass, 1e-9);
    for (int k = 0; k < 3; k++) {
        expect_near("its centre", m->body_ipos[3 * base + k], center[k], 1e-7);
    }
    for (int e = 0; e < 9; e++) {
        expect_near("its inertia", got[e], sum[e], 1e-7);
    }
    double total = mass;
    for (int i = 0; i < JOINTS; i++) {
        total += links[i % LEG].mass;
    }
    expect_near("mass", robot_total_mass(robot), total, 1e-9);
    robot_sim_destroy(sim);
}

/* ---- geometry ---- */

/* Where the feet are in the default pose: hip pitch -0.312, knee 0.669; the hip's body is tilted by
 * 0.1749 rad, and the knee's back. */
TEST(the_pose_by_hand) {
    double turn[4];
    vector(cJSON_GetArrayItem(item(numbers, "links"), 1), "quaternion", 4, turn);
    const double pitch = -0.312, knee = 0.669, tilt = 2 * atan2(-turn[2], turn[0]);
    const double thigh = pitch - tilt, shank = pitch + knee;
    const double *roll = links[1].position, *yaw = links[2].position, *shin = links[3].position;
    const double *ankle = links[4].position, length = -(yaw[2] + shin[2]), off = yaw[0] + shin[0];
    const double x =
        roll[2] * sin(pitch) + off * cos(thigh) - length * sin(thigh) + ankle[2] * sin(shank);
    const double drop = -links[0].position[2] - roll[2] * cos(pitch) + off * sin(thigh) +
                        length * cos(thigh) - ankle[2] * cos(shank) - links[5].position[2] +
                        number(numbers, "sole");
    const double y = links[0].position[1] + roll[1] + shin[1] + ankle[1];
    assert_int_equal(robot_joints(robot), JOINTS);
    assert_int_equal(robot_feet(robot), FEET);
    assert_int_equal(robot_points(robot), 0);
    expect_near("height", robot_stand_height(robot), drop, 1e-6);
    RobotSim *sim = new_sim(0.001);
    for (int f = 0; f < FEET; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        expect_near("foot's x", foot->position[0], x, 1e-6);
        expect_near("foot's y", foot->position[1], f ? -y : y, 1e-6);
        expect_near("sole's height", foot->sole_height, 0, 1e-9);
        expect_near("level", foot->rotation[8], 1, 1e-9);
    }
    expect_near("feet apart", robot_sim_foot_distance(sim), 2 * y, 1e-6);
    robot_sim_destroy(sim);
}

/* Efforts, speeds, and gains of a 10 Hz oscillator, twice critically damped, on the armature. */
TEST(motors_and_gait) {
    const double rate = 2 * 3.14159265358979 * 10;
    RobotSim *sim = new_sim(0.001);
    const mjModel *m = robot_sim_model(sim);
    for (int i = 0; i < JOINTS; i++) {
        const double armature = m->dof_armature[robot_joint_dof(robot)[i]];
        expect_near("effort", robot_effort(robot)[i], links[i % LEG].effort, 1e-9);
        expect_near("speed", robot_speed(robot)[i], links[i % LEG].speed, 1e-9);
        expect_near("kp", robot_kp(robot)[i], armature * rate * rate, 0.05);
        expect_near("kd", robot_kd(robot)[i], 4 * armature * rate, 0.01);
        assert_int_equal(robot_joint_foot(robot)[i], i / LEG);
        assert_int_equal(robot_mirror_joint(robot)[i], (i + LEG) % JOINTS);
    }
    expect_near("shift",
                fabs(robot_table(robot)->gait_offset[0] - robot_table(robot)->gait_offset[1]), 0.5,
                0);
    robot_sim_destroy(sim);
}

TEST_MAIN(open_numbers, close_numbers)
