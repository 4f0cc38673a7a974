/* What the tests of the robot layer share: a robot of the repository, a workspace, a ground. The
 * robot is SA01, or what MODEL names before this is included. */
#ifndef ROBOT_KIT_H
#define ROBOT_KIT_H

#include "base/random.h"
#include "control/stand.h"
#include "kit.h"
#include "robot/description.h"
#include "robot/robot.h"
#include "sa01.h"

#ifndef MODEL
#define MODEL SA01
#endif

static Robot *robot;
static Stand *stand;

static inline int setup(void **unused) {
    (void)unused;
    MildError error = {0};
    robot = robot_create(MODEL, &error);
    expect_good(robot != NULL, &error);
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

/* To be freed by the caller. */
static inline MildGround *new_ground(void) {
    void *block = calloc(1, mild_ground_bytes(robot_soles(robot), robot_feet(robot)));
    assert_non_null(block);
    return mild_ground_init(block, robot_soles(robot), robot_feet(robot));
}

static inline MildMaterial preset(const char *name) {
    MildMaterial material;
    assert_true(mild_material_preset(name, &material));
    return material;
}

static inline MildTerrain preset_terrain(const char *name) {
    MildMaterial material = preset(name);
    return mild_terrain_uniform(&material);
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
