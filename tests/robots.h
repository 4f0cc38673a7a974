/* A robot and the memory of its ground. */
#ifndef TEST_ROBOTS_H
#define TEST_ROBOTS_H

#include "kit.h"
#include "materials.h"
#include "robot/robot.h"

/* A robot of a folder. */
static inline Robot *kit_robot(const char *folder) {
    MildError error = {0};
    Robot *robot = robot_create(folder, &error);
    expect_good(robot != NULL, &error);
    return robot;
}

/* A robot of the repository. */
static inline Robot *kit_robot_named(const char *name) {
    MildError error = {0};
    Robot *robot = robot_open(name, &error);
    expect_good(robot != NULL, &error);
    return robot;
}

/* Ground that has met none of the robot's bodies. To be freed by the caller. */
static inline MildGround *kit_ground(const Robot *robot) {
    const int bodies = robot_bodies(robot);
    const size_t bytes = mild_ground_bytes(robot_soles(robot), bodies);
    void *block = aligned_alloc(64, (bytes + 63) / 64 * 64);
    assert_non_null(block);
    return mild_ground_init(block, robot_soles(robot), bodies);
}

#endif
