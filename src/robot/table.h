/* The numbers of a Robot that a task needs, without pointers, so that a device can have them too.
 * The fields are what the functions of the same names in robot.h return. */
#ifndef ROBOT_TABLE_H
#define ROBOT_TABLE_H

#include "robot/limits.h"

typedef struct {
    int joints;
    int feet;
    int joint_foot[ROBOT_JOINTS_MAX];
    double default_pose[ROBOT_JOINTS_MAX];
    double joint_low[ROBOT_JOINTS_MAX];
    double joint_high[ROBOT_JOINTS_MAX];
    double effort[ROBOT_JOINTS_MAX];
    double speed[ROBOT_JOINTS_MAX];
    double swing[ROBOT_JOINTS_MAX];
    double still[ROBOT_JOINTS_MAX];
    double gait_offset[ROBOT_FEET_MAX];
    double feet_range[2];
    double knee_range[2];
    double feet_least;
    double knee_least;
    double assist[4];
    double total_mass;
    double stand_height;
    double nominal_height;
    double action_scale;
    double foot_force;
} RobotTable;

#endif
