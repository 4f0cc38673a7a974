/* An environment of the batch engine, in the sizes of the robot that the code is compiled for
 * (robot/engine/model.h). */
#ifndef ENVS_BATCH_ENV_H
#define ENVS_BATCH_ENV_H

#include <assert.h>

#include "robot/engine/model.h"

#define TASK_JOINTS ENGINE_JOINTS
#define TASK_FEET ENGINE_FEET
#include "env/batch_arrays.h"
#include "robot/engine/data.h"
#include "robot/engine/saved.h"
#include "robot/engine/shells.h"

/* Of one environment besides its TaskEnv. */
typedef struct {
    alignas(16) EngineSaved saved; /* between the parts of a step */
    TaskSensors sensors;
    int label; /* of the map under the base */
    Real tally[TALLY_KEPT];
    int diverged; /* bool: in this policy step */
} EnvRobot;

/* Besides, where shells stand, on either ground. */
typedef struct {
    alignas(16) EngineSavedLinks links; /* of a robot with shells near the ground */
    Real load;                          /* [N] on the shells, vertical, in the last step */
} EnvShells;

/* What a warp has in shared memory. */
typedef struct {
    EngineWork work;
    EngineVariation variation;
    TaskMotor motor[ENGINE_JOINTS];
    Real torque[ENGINE_JOINTS]; /* [N m] in the order of robot.ini */
    Real base_wrench[6];        /* [N, N m] at the base's centre of mass, world */
    Real qpos[7 + ENGINE_JOINTS];
    Real qvel[6 + ENGINE_JOINTS];
    Real corner[ENGINE_CORNERS]; /* [m] depth of the corners in rigid ground */
} EnvWork;

MILD_HD TaskEnv *env_at(const EnvsArrays *all, long robot) {
    return (TaskEnv *)(void *)(all->env + (size_t)robot * all->stride);
}

MILD_HD EnvRobot *env_robot_at(const EnvsArrays *all, long robot) {
    return (EnvRobot *)(void *)all->robot + robot;
}

/* In the place of the rows that a part saves, which the next one has read: from env_measure to the
 * end of a policy step, and in the samples of a physics step. */
MILD_HD RobotReading *env_reading(EnvRobot *own) {
    static_assert(sizeof(RobotReading) <= sizeof own->saved.rows, "it has room there");
    return (RobotReading *)(void *)own->saved.rows;
}

MILD_HD EnvShells *env_shells_at(const EnvsArrays *all, long robot) {
    return (EnvShells *)(void *)all->shells.robot + robot;
}

MILD_HD int env_physics_steps(const EnvsTask *task) {
    return (int)(TASK_PERIOD / task->task.physics_dt + 0.5);
}

#endif
