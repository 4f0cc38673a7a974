/* The numbers of a Robot that a task needs, without pointers, so that a device can have them too.
 * Fields without a remark are what the functions of the same names in robot.h return. */
#ifndef ROBOT_TABLE_H
#define ROBOT_TABLE_H

#include "robot/limits.h"

typedef struct {
    int joints;
    int actions; /* joints that a policy acts on, the first; the others are driven */
    int feet;
    int shells_stand; /* bool: robot_bodies counts those with shells */
    int joint_foot[ROBOT_JOINTS_MAX];
    double default_pose[ROBOT_JOINTS_MAX];
    double joint_low[ROBOT_JOINTS_MAX];
    double joint_high[ROBOT_JOINTS_MAX];
    double effort[ROBOT_JOINTS_MAX];
    double speed[ROBOT_JOINTS_MAX];
    double full_speed[ROBOT_JOINTS_MAX]; /* [rad/s] whole torque up to there; 0: up to `speed` */
    double swing[ROBOT_JOINTS_MAX];
    double still[ROBOT_JOINTS_MAX];     /* [-] 1: should stay near the default pose */
    double gait_offset[ROBOT_FEET_MAX]; /* [-] phase of the gait cycle when its stance begins */
    double feet_range[2];               /* [m] allowed for the lateral distance of mirrored feet */
    double knee_range[2];               /* [m] and of their knees */
    double feet_least;                  /* [m] below which feet collide */
    double knee_least;                  /* [m] and knees */
    /* Assistance early in training: stiffness [N m/rad] and damping [N m s/rad] against tilt, gain
     * [N s/m] towards the commanded velocity, and the limit of that force [N]. */
    double assist[4];
    double total_mass;
    double stand_height;
    double nominal_height;
    double action_scale; /* [rad] joint offset per unit of action */
    double foot_force;   /* [N] above which a landing is hard */
} RobotTable;

#endif
