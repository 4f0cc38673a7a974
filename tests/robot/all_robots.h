/* The robots of the repository without contact between their legs, which test_legs.c has, and poses
 * anywhere within the ranges of their joints. */
#ifndef ALL_ROBOTS_H
#define ALL_ROBOTS_H

#include "base/random.h"
#include "robot/sim.h"
#include "robots.h"

enum { ROBOTS = 3 };
static const char *const names[ROBOTS] = {"sa01", "go1", "g1"};
static Robot *robots[ROBOTS];

static inline int open_robots(void **state) {
    (void)state;
    for (int r = 0; r < ROBOTS; r++) {
        robots[r] = kit_robot_named(names[r]);
        robots[r]->leg_pairs = 0;
    }
    return 0;
}

static inline int close_robots(void **state) {
    (void)state;
    for (int r = 0; r < ROBOTS; r++) {
        robot_destroy(robots[r]);
    }
    return 0;
}

/* At rest, turned anyhow, its base at the height. */
static inline RobotState random_pose(const Robot *robot, double height, Random *random) {
    RobotState state = {.qpos = {0, 0, height}};
    for (int k = 3; k < 7; k++) {
        state.qpos[k] = random_normal(random);
    }
    mju_normalize4(state.qpos + 3);
    for (int j = 0; j < robot->def.joints; j++) {
        state.qpos[7 + j] = random_uniform(random, robot->low[j], robot->high[j]);
    }
    return state;
}

/* Torques that hold a pose, with a stiffness of some of the effort a radian. qpos, qvel: in the
 * robot's order */
static inline void hold_pose(const Robot *robot, const double *pose, double stiffness,
                             const double *qpos, const double *qvel, double *torque) {
    for (int j = 0; j < robot->def.joints; j++) {
        const double error = pose[j] - qpos[7 + j] - 0.03 * qvel[6 + j];
        torque[j] = stiffness * robot->effort[j] * error;
        torque[j] = fmax(fmin(torque[j], robot->effort[j]), -robot->effort[j]);
    }
}

#endif
