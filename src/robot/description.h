/* Private to the robot layer: what a Robot knows of its model file. */
#ifndef ROBOT_DESCRIPTION_H
#define ROBOT_DESCRIPTION_H

#include <mujoco/mujoco.h>

#include "robot/robot.h"

#define ROBOT_LEG 6           /* joints of one leg */
#define ROBOT_SHELLS 3        /* boxes that must not touch the ground: base, shanks */
#define ROBOT_OUTLINE_MAX 128 /* points of a sole outline */
#define ROBOT_ELEMENTS_MAX 65536

struct Robot {
    mjModel *model;  /* bodies, joints, floor and sole corners: what a step needs */
    mjModel *visual; /* the whole file, for pictures */
    MildSole *soles[ROBOT_FEET],
        *concentric[ROBOT_FEET]; /* the rasters, and one element in the middle of each */
    int is_concentric;           /* bool: which of them the feet have */
    double outline[ROBOT_FEET][2 * ROBOT_OUTLINE_MAX]; /* [m] x y, foot frame */
    int outline_points[ROBOT_FEET];
    double sole_z;                     /* [m] */
    double sole_center[ROBOT_FEET][3]; /* [m] foot frame, middle of the outline's bounds */
    int base_body, foot_body[ROBOT_FEET], knee_body[ROBOT_FEET], floor_geom;
    int shell_body[ROBOT_SHELLS];
    double shell_center[ROBOT_SHELLS][3], shell_half[ROBOT_SHELLS][3]; /* [m] body frame */
    double pose[ROBOT_JOINTS], low[ROBOT_JOINTS], high[ROBOT_JOINTS];  /* [rad] */
    double effort[ROBOT_JOINTS];                                       /* [N m] */
    double total_mass, stand_height;
    /* the balanced stand (stand.c): default pose leaning forward until the centre of mass is over
     * the soles' centre */
    double lean;         /* [rad] */
    double lean_base[3]; /* [m] base above a point on the ground midway below the ankles */
    double lean_torque[ROBOT_JOINTS]; /* [N m] that holds it at rest */
};

/* Fills the balanced stand; 0, or 1 when out of memory. */
int stand_prepare(Robot *robot);

/* Name of joint or link i in joint order ("leg_l1", ...); add "_joint" or "_link". */
const char *robot_limb_name(int i);

/* Whether the numbers of the compiled model are usable: finite, and masses, inertias, gains and
 * limits of the right sign. MuJoCo takes what an MJCF states. */
MildStatus robot_check_model(const Robot *robot, const char *path, MildError *error);

#endif
