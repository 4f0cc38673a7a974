/* What the tests of the robot layer share: a robot of the repository, a workspace, a ground. The
 * robot is SA01, or what MODEL names before this is included. */
#ifndef ROBOT_KIT_H
#define ROBOT_KIT_H

#include "base/random.h"
#include "robot/description.h"
#include "robots.h"
#include "sa01.h"

#ifndef MODEL
#define MODEL SA01
#endif

static Robot *robot;

static inline int setup(void **unused) {
    (void)unused;
    robot = kit_robot(MODEL);
    robot->leg_pairs = 0; /* random poses are held to MuJoCo's own step; test_legs.c has the legs */
    return 0;
}

static inline int teardown(void **unused) {
    (void)unused;
    robot_destroy(robot);
    return 0;
}

static inline RobotSim *new_sim(double dt) {
    MildError error = {0};
    RobotSim *sim = robot_sim_create(robot, dt, &error);
    assert_non_null(sim);
    return sim;
}

#endif
