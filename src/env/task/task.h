/* One environment on the CPU, top to bottom: command, act, observe, reward, randomise, terminate
 * (docs/task.md sections 4 to 11). A TaskEnv is the head of one pointer-free block (its ground
 * memory follows it), so that copying, hashing and saving are one line. Every random number is a
 * function of (seed, environment, tick), so a run depends on no thread count.
 *
 * The functions of a policy step but for its physics are in step.h and what that includes. */
#ifndef MILD_TASK_H
#define MILD_TASK_H

#ifdef MILD_REAL_FLOAT
#error "the environments of the CPU are in double: include env/task/state.h"
#endif

#include "env/task/step.h"
#include "mild/error.h"
#include "robot/robot.h"

/* What an environment has besides on the CPU; behind the frames of its TaskEnv. */
typedef struct {
    double qacc[ROBOT_NV_MAX]; /* of RobotState */
    MildTerrain terrain;       /* its map is that of TaskDef during a call and NULL between calls,
                                  so that the block contains no pointer */
    TaskGains gains;
} TaskRest;

/* A controller that commands torques. It is called at the start of every physics step and writes
 * [robot_joints] torques, which take the place of the joints' PD, without its latency. The limits
 * of the motors apply to them. The terrain's map is set during the call. */
typedef struct {
    void (*torque)(void *context, const TaskEnv *env, RobotSim *sim, double *torque);
    void *context;
} TaskDrive;

/* Observer for measures and pictures. It is called at the end of every physics step. The terrain's
 * map is set during the call. */
typedef struct {
    void (*physics_step)(void *context, const TaskEnv *env, const RobotSim *sim,
                         const double *torque);
    void *context;
    const TaskDrive *drive; /* NULL: the joints' PD on the actions */
} TaskCallback;

/* ---- the block ---- */

/* One block: TaskEnv with its frames and poses, TaskRest, the history, the ground memory, the state
 * of TaskDef.motors; a multiple of 64. */
size_t task_env_bytes(const TaskDef *def, const Robot *robot);
TaskRest *task_env_rest(TaskEnv *env);
const MildTerrain *task_env_terrain(const TaskEnv *env); /* of TaskRest */
/* [shape.history] What the policy sees: five means of older frames, the newest frame, the scan. */
float *task_env_history(TaskEnv *env);
const float *task_env_frame(TaskEnv *env); /* [shape.observation] the newest frame of it */
MildGround *task_env_ground(TaskEnv *env);

void task_env_init(TaskEnv *env, const TaskDef *def, const Robot *robot, uint64_t seed,
                   uint32_t index);

/* ---- the robot's state ---- */

RobotState task_env_state(const TaskEnv *env);
void task_env_set_state(TaskEnv *env, const RobotState *state);
RobotVariation task_env_variation(const TaskEnv *env);
/* robot_sim_load with both. */
void task_env_load(const TaskEnv *env, RobotSim *sim);
/* What the task asks of a sim after a load or a step. */
void task_env_read(const TaskEnv *env, const RobotSim *sim, RobotReading *reading);

/* ---- steps ---- */

/* Draws a new episode and writes its first observation. */
void task_env_reset(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                    const EnvsView *view);
/* The same, but the caller has chosen the terrain, except for its map, and whether to use the
 * engine's rigid ground, with the friction TASK_RIGID_FRICTION. The map is that of the TaskDef. */
void task_env_reset_on(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                       const MildTerrain *terrain, int rigid, const EnvsView *view);
/* One policy step. When the episode ends, with auto_reset a new one is drawn and its first
 * observation is written. */
TaskStep task_env_step(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                       const float *action, int auto_reset, const EnvsView *view,
                       const TaskCallback *callback);

/* ---- parts of the step on the CPU ---- */

/* Draws ground, robot and sensors of an episode. */
void task_env_draw(TaskEnv *env, const TaskDef *def, const Robot *robot);
/* task_observe of a sim, which may be NULL for a view without critic and estimate. */
void task_env_observe(TaskEnv *env, const TaskDef *def, const Robot *robot, const RobotSim *sim,
                      const TaskSensors *sensors, int first, const EnvsView *view);

/* Draws the ground of an episode: one material, or stripes of three (ground.c). */
void task_draw_ground(TaskEnv *env, const TaskDef *def, const Robot *robot, Random *r);
/* Draws where on the map it begins, and a material for each of its labels. */
void task_draw_on_map(TaskEnv *env, const TaskDef *def, const Robot *robot, Random *r);

#endif
