/* What the tests of the actuator share: the robot, comparisons that name what differs. */
#ifndef ACTUATOR_KIT_H
#define ACTUATOR_KIT_H

#include "base/random.h"
#include "kit.h"
#include "robot/robot.h"
#include "sa01.h"

enum { KINDS = 3 }; /* of the robot's motors */

static Robot *robot;

static inline int kit_setup(void **state) {
    (void)state;
    MildError error = {0};
    robot = robot_create(SA01, &error);
    return robot == NULL;
}

static inline int kit_teardown(void **state) {
    (void)state;
    robot_destroy(robot);
    return 0;
}

#endif
