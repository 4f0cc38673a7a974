/* Robot and RobotSim of a device: the numbers that the functions of robot.h return for the task's
 * code, as functions of the same names, and of robot/state.h what that code uses. Include lanes.h,
 * which includes this file on a device; never together with robot.h. */
#ifndef TASK_DEVICE_ROBOT_H
#define TASK_DEVICE_ROBOT_H

#include "base/hd.h"
#include "robot/table.h"

typedef RobotTable Robot;

typedef struct {
    TaskReal qpos[7 + TASK_JOINTS];
    TaskReal qvel[6 + TASK_JOINTS];
} RobotState;

typedef struct {
    TaskReal base_mass_add;
    TaskReal com_offset[3];
    TaskReal link_mass_scale[1 + TASK_JOINTS];
    TaskReal armature_scale;
    TaskReal rigid_friction;
    TaskReal rigid_time;
    int rigid;
} RobotVariation;

typedef struct {
    TaskReal force[3];
    TaskReal sole_height;
    TaskReal sole_center[3];
    TaskReal sole_center_velocity[3];
    struct {
        TaskReal depth_mean;
    } result;
} RobotFoot;

/* What the last physics step left behind, as RobotSim answers. */
typedef struct {
    const RobotState *state;
    TaskReal rotation[9];
    RobotFoot foot[TASK_FEET];
    TaskReal body_clearance;
    TaskReal knee_distance;
    TaskReal foot_distance;
    TaskReal above; /* [m] height of the base above the ground under it */
    int label;      /* of the map there */
} RobotSim;

/* Of MildTerrain what differs from episode to episode. */
typedef struct {
    TaskReal height;
    TaskReal map_x;
    TaskReal map_y;
} TaskTerrain;

#define DEVICE_ROBOT_LIST(name)                                                                    \
    MILD_HD_FN const double *robot_##name(const Robot *robot) {                                    \
        return robot->name;                                                                        \
    }
#define DEVICE_ROBOT_NUMBER(name)                                                                  \
    MILD_HD_FN double robot_##name(const Robot *robot) {                                           \
        return robot->name;                                                                        \
    }
DEVICE_ROBOT_LIST(default_pose)
DEVICE_ROBOT_LIST(joint_low)
DEVICE_ROBOT_LIST(joint_high)
DEVICE_ROBOT_LIST(effort)
DEVICE_ROBOT_LIST(speed)
DEVICE_ROBOT_LIST(swing)
DEVICE_ROBOT_LIST(still)
DEVICE_ROBOT_LIST(feet_range)
DEVICE_ROBOT_LIST(knee_range)
DEVICE_ROBOT_LIST(assist)
DEVICE_ROBOT_NUMBER(feet_least)
DEVICE_ROBOT_NUMBER(knee_least)
DEVICE_ROBOT_NUMBER(total_mass)
DEVICE_ROBOT_NUMBER(stand_height)
DEVICE_ROBOT_NUMBER(nominal_height)
DEVICE_ROBOT_NUMBER(action_scale)
DEVICE_ROBOT_NUMBER(foot_force)

MILD_HD_FN int robot_joints(const Robot *robot) {
    return robot->joints;
}

MILD_HD_FN const int *robot_joint_foot(const Robot *robot) {
    return robot->joint_foot;
}

MILD_HD_FN double robot_gait_offset(const Robot *robot, int foot) {
    return robot->gait_offset[foot];
}

MILD_HD_FN const TaskReal *robot_sim_qpos(const RobotSim *sim) {
    return sim->state->qpos;
}

MILD_HD_FN const TaskReal *robot_sim_qvel(const RobotSim *sim) {
    return sim->state->qvel;
}

MILD_HD_FN const TaskReal *robot_sim_base_rotation(const RobotSim *sim) {
    return sim->rotation;
}

MILD_HD_FN const RobotFoot *robot_sim_foot(const RobotSim *sim, int foot) {
    return &sim->foot[foot];
}

MILD_HD_FN double robot_sim_body_clearance(const RobotSim *sim, const TaskTerrain *terrain) {
    (void)terrain;
    return sim->body_clearance;
}

MILD_HD_FN double robot_sim_knee_distance(const RobotSim *sim) {
    return sim->knee_distance;
}

MILD_HD_FN double robot_sim_foot_distance(const RobotSim *sim) {
    return sim->foot_distance;
}

#endif
