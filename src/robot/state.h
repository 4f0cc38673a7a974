/* What a simulation of a robot reads and writes: plain numbers without pointers. Joints and feet
 * are numbered in the order of robot.ini. */
#ifndef ROBOT_STATE_H
#define ROBOT_STATE_H

#include "robot/limits.h"

/* Persistent state. Entries beyond the robot's joints are 0. */
typedef struct {
    double qpos[ROBOT_NQ_MAX]; /* [m, -, rad] base x y z, quaternion w x y z, joints */
    /* [m/s, rad/s] Base linear velocity (world axes), angular velocity (base axes), joints. */
    double qvel[ROBOT_NV_MAX];
    double qacc[ROBOT_NV_MAX]; /* [m/s^2, rad/s^2] of the last step: which joint limits push in the
                                  next one, and where its solver starts */
} RobotState;

/* What differs from robot to robot (domain randomisation). */
typedef struct {
    double base_mass_add; /* [kg] added to the base */
    double com_offset[3]; /* [m] shift of the base's centre of mass */
    /* [-] Scale of mass and inertia: of the base, then of the body of each joint. */
    double link_mass_scale[1 + ROBOT_JOINTS_MAX];
    double armature_scale; /* [-] of the joints' armature */
    double rigid_friction; /* [-] friction coefficient of the engine's contact when rigid */
    double rigid_time; /* [s] time constant of that contact, critically damped; 0: the model's */
    int rigid;         /* bool: the engine's own contact under the feet's corners, no soft ground */
    int shells_stand;  /* bool: the ground pushes against shells, see robot_set_shells */
} RobotVariation;

/* State of a foot after a step, in world axes about its reference point. The reference point is the
 * origin of a flat foot's body, or the lowest point of a round foot. A round foot transmits no
 * moment, so its rotation is the identity, and its torque and angular velocity are 0. */
typedef struct {
    double position[3];             /* [m] reference point */
    double rotation[9];             /* [-] foot to world, row major */
    double velocity[6];             /* [m/s, rad/s] twist at the reference point */
    double force[3];                /* [N] of the ground on the foot, mean over the step */
    double torque[3];               /* [N m] about the reference point */
    double sole_height;             /* [m] lowest sole point above h0 (above z = 0 after
                                       robot_sim_load), negative when sunk */
    double sole_center[3];          /* [m] centre of the sole */
    double sole_center_velocity[3]; /* [m/s] */
    MildFootResult result;
} RobotFoot;

#endif
