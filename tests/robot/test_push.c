/* A push on the base, force and torque in world axes, is what the engine does with xfrc_applied:
 * each of the six axes alone and all of them at once, at poses in motion, whatever the mass. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "robot_kit.h"

#include <mujoco/mujoco.h>

#include "sa01.h"

static RobotState moving_state(uint32_t draw) {
    Random random = random_at(17, draw, 0);
    RobotState state = stand_state(stand, 0, -1.0); /* 1 m above the ground */
    double norm = 0;
    for (int i = 3; i < 7; i++) {
        state.qpos[i] += random_uniform(&random, -0.5, 0.5);
        norm += state.qpos[i] * state.qpos[i];
    }
    for (int i = 3; i < 7; i++) {
        state.qpos[i] /= sqrt(norm);
    }
    kit_disturb(&state, &random);
    return state;
}

/* The engine's step under the same push, on data of its own. */
static void engine_step(RobotSim *sim, const RobotState *state, const double *torque,
                        const double *push, RobotState *after) {
    mjModel *m = robot_sim_model(sim);
    mjData *d = mj_makeData(m);
    int base = mj_name2id(m, mjOBJ_BODY, "base_link");
    memcpy(d->qpos, state->qpos, sizeof state->qpos);
    memcpy(d->qvel, state->qvel, sizeof state->qvel);
    memcpy(d->qfrc_applied + 6, torque, sizeof(double) * SA01_JOINTS);
    if (push) {
        memcpy(d->xfrc_applied + 6 * base, push, 6 * sizeof *push);
    }
    mj_step(m, d);
    memcpy(after->qpos, d->qpos, sizeof after->qpos);
    memcpy(after->qvel, d->qvel, sizeof after->qvel);
    mj_deleteData(d);
}

static double worst_difference(RobotSim *sim, const RobotState *after) {
    double worst = 0;
    for (int i = 0; i < SA01_NQ; i++) {
        worst = fmax(worst, fabs(robot_sim_qpos(sim)[i] - after->qpos[i]));
    }
    for (int i = 0; i < SA01_NV; i++) {
        worst = fmax(worst, fabs(robot_sim_qvel(sim)[i] - after->qvel[i]));
    }
    return worst;
}

/* [m/s, rad/s] how much the push alone changes the speeds. */
static double effect(const RobotState *pushed, const RobotState *left_alone) {
    double largest = 0;
    for (int i = 0; i < SA01_NV; i++) {
        largest = fmax(largest, fabs(pushed->qvel[i] - left_alone->qvel[i]));
    }
    return largest;
}

static void push_is_the_engines(int rigid) {
    RobotSim *sim = new_sim(0.0025);
    MildTerrain terrain = kit_terrain("sand_loose");
    MildGround *ground = kit_ground(robot);
    RobotVariation variation = robot_variation_nominal();
    variation.rigid = rigid;
    variation.base_mass_add = 3;
    variation.com_offset[0] = 0.05;
    variation.com_offset[1] = -0.04;
    variation.com_offset[2] = 0.03;
    double worst = 0, weakest = 1e9;
    for (uint32_t draw = 0; draw < 6; draw++) {
        RobotState state = moving_state(draw), pushed, alone;
        double torque[SA01_JOINTS];
        for (int i = 0; i < SA01_JOINTS; i++) {
            torque[i] = 2.0 * (i % 5) - 4;
        }
        for (int axis = -1; axis <= 6; axis++) { /* -1: none, 6: all */
            double push[6] = {0};
            for (int i = 0; i < 6; i++) {
                push[i] = axis == i || axis == 6 ? (i % 2 ? -40 - 5 * i : 30 + 5 * i) : 0;
            }
            robot_sim_load(sim, &state, &variation);
            engine_step(sim, &state, torque, axis < 0 ? NULL : push, &pushed);
            assert_int_equal(robot_sim_step(sim, torque, axis < 0 ? NULL : push, &terrain, ground),
                             0);
            double difference = worst_difference(sim, &pushed);
            if (!(difference < 1e-10)) {
                fail_msg("axis %d of draw %u: %.2e off", axis, draw, difference);
            }
            worst = fmax(worst, difference);
            if (axis < 0) {
                alone = pushed;
            } else {
                weakest = fmin(weakest, effect(&pushed, &alone));
            }
        }
    }
    print_message("%s: push against xfrc_applied: worst %.1e, the least push changes a speed by "
                  "%.1e\n",
                  rigid ? "rigid" : "soft", worst, weakest);
    assert_true(weakest > 1e-3);
    free(ground);
    robot_sim_destroy(sim);
}

TEST(test_soft) {
    push_is_the_engines(0);
}

TEST(test_rigid) {
    push_is_the_engines(1);
}

TEST_MAIN(setup, teardown)
