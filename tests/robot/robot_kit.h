/* What the tests of the robot layer share: a robot of the repository, a workspace, a ground. The
 * robot is SA01, or what MODEL names before this is included. */
#ifndef ROBOT_KIT_H
#define ROBOT_KIT_H

#include "base/random.h"
#include "control/stand.h"
#include "robot/description.h"
#include "robots.h"
#include "sa01.h"

#ifndef MODEL
#define MODEL SA01
#endif

static Robot *robot;
static Stand *stand;

static inline int setup(void **unused) {
    (void)unused;
    MildError error = {0};
    robot = kit_robot(MODEL);
    robot->leg_pairs = 0; /* random poses are held to MuJoCo's own step; test_legs.c has the legs */
    stand = stand_create(robot, &error);
    assert_non_null(stand);
    return 0;
}

static inline int teardown(void **unused) {
    (void)unused;
    stand_destroy(stand);
    robot_destroy(robot);
    return 0;
}

static inline RobotSim *new_sim(double dt) {
    MildError error = {0};
    RobotSim *sim = robot_sim_create(robot, dt, &error);
    assert_non_null(sim);
    return sim;
}

/* Joints a little off their places, all of it in motion. */
static inline void kit_disturb(RobotState *state, Random *random) {
    for (int i = 0; i < robot_joints(robot); i++) {
        state->qpos[7 + i] += random_uniform(random, -0.1, 0.1);
    }
    for (int i = 0; i < 6 + robot_joints(robot); i++) {
        state->qvel[i] = random_uniform(random, -0.5, 0.5);
    }
}

#endif
