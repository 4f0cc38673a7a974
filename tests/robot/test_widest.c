/* The widest robot that fits: forty joints, four feet, its step against the engine's. */
#include <math.h>
#include <string.h>

#include "robot_kit.h"

#include <mujoco/mujoco.h>

#include "widest.h"

enum { JOINTS = ROBOT_JOINTS_MAX, NV = ROBOT_NV_MAX };

static RobotSim *sim;

static int open_widest(void **unused) {
    (void)unused;
    MildError error = {0};
    robot = widest_open(&error);
    sim = robot ? robot_sim_create(robot, 0.001, &error) : NULL;
    expect_good(sim != NULL, &error);
    return 0;
}

static int close_widest(void **unused) {
    (void)unused;
    robot_sim_destroy(sim);
    return widest_close(robot);
}

static RobotState draw_state(uint32_t draw) {
    Random r = random_at(61, draw, 0);
    RobotState state = {.qpos = {0.1, -0.2, 3}};
    double angle[3] = {random_uniform(&r, -1, 1), random_uniform(&r, -1, 1),
                       random_uniform(&r, -3, 3)};
    mju_euler2Quat(state.qpos + 3, angle, "XYZ");
    for (int i = 0; i < JOINTS; i++) {
        state.qpos[7 + i] = random_uniform(&r, -0.9, 0.9);
    }
    for (int i = 0; i < NV; i++) {
        state.qvel[i] = random_uniform(&r, -1, 1);
    }
    return state;
}

/* Least of both mirrored pairs: feet, then knees, left less right along the base's left; 0 when the
 * base points straight up. */
TEST(test_distances) {
    RobotVariation nominal = robot_variation_nominal();
    const mjData *d = robot_sim_data(sim);
    const mjModel *m = robot_sim_model(sim);
    int which[2] = {0};
    for (uint32_t draw = 0; draw < 20; draw++) {
        RobotState state = draw_state(draw);
        robot_sim_load(sim, &state, &nominal);
        const double x[3] = {1, 0, 0}, z[3] = {0, 0, 1};
        double ahead[3], left[3], feet[2], knees[2];
        mju_rotVecQuat(ahead, x, state.qpos + 3);
        ahead[2] = 0;
        mju_normalize3(ahead);
        mju_cross(left, z, ahead);
        for (int pair = 0; pair < 2; pair++) {
            double between[3];
            char name[2][8];
            mju_sub3(between, robot_sim_foot(sim, 2 * pair)->sole_center,
                     robot_sim_foot(sim, 2 * pair + 1)->sole_center);
            feet[pair] = mju_dot3(between, left);
            for (int side = 0; side < 2; side++) {
                snprintf(name[side], sizeof name[side], "b%d5", 2 * pair + side);
            }
            mju_sub3(between, d->xpos + 3 * mj_name2id(m, mjOBJ_BODY, name[0]),
                     d->xpos + 3 * mj_name2id(m, mjOBJ_BODY, name[1]));
            knees[pair] = mju_dot3(between, left);
        }
        which[feet[0] < feet[1]]++;
        assert_true(fabs(robot_sim_foot_distance(sim) - fmin(feet[0], feet[1])) < 1e-12);
        assert_true(fabs(robot_sim_knee_distance(sim) - fmin(knees[0], knees[1])) < 1e-12);
    }
    assert_true(which[0] > 2 && which[1] > 2);
    RobotState up = draw_state(0);
    const double nose_up[4] = {sqrt(0.5), 0, -sqrt(0.5), 0};
    memcpy(up.qpos + 3, nose_up, sizeof nose_up);
    robot_sim_load(sim, &up, &nominal);
    assert_true(robot_sim_knee_distance(sim) == 0 && robot_sim_foot_distance(sim) == 0);
}

TEST(test_step) {
    RobotVariation nominal = robot_variation_nominal();
    MildTerrain terrain = kit_terrain("grass");
    MildGround *ground = kit_ground(robot);
    const mjModel *m = robot_sim_model(sim);
    double worst = 0;
    for (uint32_t draw = 0; draw < 5; draw++) {
        RobotState state = draw_state(draw);
        double torque[JOINTS];
        mjData *d = mj_makeData(m);
        robot_sim_load(sim, &state, &nominal);
        memcpy(d->qpos, state.qpos, sizeof(double) * (NV + 1));
        memcpy(d->qvel, state.qvel, sizeof(double) * NV);
        for (int i = 0; i < JOINTS; i++) {
            torque[i] = d->qfrc_applied[6 + i] = 0.2 * (i % 7) - 0.6;
        }
        for (int t = 0; t < 20; t++) {
            mj_step(m, d);
            assert_int_equal(robot_sim_step(sim, torque, NULL, &terrain, ground), 0);
        }
        for (int i = 0; i < NV; i++) {
            worst = fmax(worst, fabs(d->qvel[i] - robot_sim_qvel(sim)[i]));
            worst = fmax(worst, fabs(d->qpos[i + 1] - robot_sim_qpos(sim)[i + 1]));
        }
        mj_deleteData(d);
    }
    print_message("twenty steps in the air against mj_step: worst %.1e\n", worst);
    assert_true(worst < 1e-9);
    free(ground);
}

TEST_MAIN(open_widest, close_widest)
