/* Driven joints (docs/task.md section 10): those of robot.ini that another program moves, such as a
 * teleoperator the arms, while the policy acts on the others. In its place they go to random goals.
 * Their targets are kept as actions, behind those of the policy, so that the motors treat all
 * joints alike. */
#ifndef TASK_DRIVEN_H
#define TASK_DRIVEN_H

#include <math.h>

#include "base/random.h"
#include "env/task/state.h"

#define TASK_RANDOM_DRIVEN 0x4452564eu
#define DRIVEN_SOONEST 1.0    /* [s] shortest time from goal to goal */
#define DRIVEN_LATEST 3.0     /* [s] */
#define DRIVEN_APPROACH 0.2   /* [s] from the distance of a goal to the speed towards it */
#define DRIVEN_QUICKNESS 0.05 /* [s] of that speed; a quarter of DRIVEN_APPROACH: no overshoot */

/* Where a driven joint goes. */
typedef struct {
    double angle; /* [rad] */
    double speed; /* [rad/s] at most */
} DrivenGoal;

/* Goal of joint i that was drawn at the tick: its numbers 2 i and 2 i + 1. */
MILD_HD_FN DrivenGoal driven_goal(const TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                                  uint32_t tick, int i) {
    Random r = random_after(random_at(env->seed ^ TASK_RANDOM_DRIVEN, env->index, tick), 2 * i);
    const double pose = robot->default_pose[i], to = 2 * random_unit(&r) - 1;
    const double end = to < 0 ? robot->joint_low[i] : robot->joint_high[i];
    const DrivenGoal goal = {pose + def->driven_range * fabs(to) * (end - pose),
                             random_uniform(&r, def->driven_speed[0], def->driven_speed[1])};
    return goal;
}

/* [policy steps] From the goals that were drawn at the tick to the next: number 0. */
MILD_HD_FN uint32_t driven_wait(const TaskEnv *env, uint32_t tick) {
    Random r = random_at(env->seed ^ TASK_RANDOM_DRIVEN, env->index, tick);
    return (uint32_t)(random_uniform(&r, DRIVEN_SOONEST, DRIVEN_LATEST) / TASK_PERIOD + 0.5);
}

/* [-] The action whose target is an angle, see task_motor. */
MILD_HD_FN float driven_action(const TaskDef *def, const RobotTable *robot, int i, double angle) {
    return (float)((angle - robot->default_pose[i]) / task_action_scale(def, robot));
}

/* At the start of an episode: whether the driven joints move, and, if so, their angles, which are
 * their first goals. Else they stay in the default pose. */
MILD_HD_FN void task_start_driven(TaskEnv *env, const TaskDef *def, const RobotTable *robot) {
    const uint32_t tick = env->tick;
    if (robot->actions == robot->joints) {
        return;
    }
    Random r = random_at(env->seed ^ TASK_RANDOM_DRIVEN, env->index, tick);
    r = random_after(r, 1);
    const int drives = random_unit(&r) < def->driven_share;
    for (int i = env->shape.actions + tile_lane(); drives && i < env->shape.joints; i += TILE) {
        const double angle = driven_goal(env, def, robot, tick, i).angle;
        for (int ago = 0; ago < 3; ago++) {
            env->action[ago][i] = driven_action(def, robot, i, angle);
        }
        env->robot.qpos[7 + i] = (Real)angle;
    }
    tile_sync();
    if (tile_lane() == 0) {
        env->drives = drives;
        env->driven_tick = tick;
    }
    tile_sync();
}

/* [rad] The target of a driven joint a policy step later. It follows the goal as a critically
 * damped spring whose speed is bounded by the goal's.
 *
 *     w = clip((goal - x) / DRIVEN_APPROACH)
 *     v' = v + (w - v) T / DRIVEN_QUICKNESS,  x' = x + v' T
 */
MILD_HD_FN double driven_next(DrivenGoal goal, double x, double before) {
    const double v = (x - before) / TASK_PERIOD;
    const double wanted = fmin(fmax((goal.angle - x) / DRIVEN_APPROACH, -goal.speed), goal.speed);
    return x + TASK_PERIOD * (v + (wanted - v) * (TASK_PERIOD / DRIVEN_QUICKNESS));
}

/* What a policy step does to the driven joints, as task_accept_action to the others. */
MILD_HD_FN void task_move_driven(TaskEnv *env, const TaskDef *def, const RobotTable *robot) {
    if (robot->actions == robot->joints || !env->drives) {
        return;
    }
    const uint32_t last = env->driven_tick;
    const uint32_t tick = env->tick - last < driven_wait(env, last) ? last : env->tick;
    const double scale = task_action_scale(def, robot);
    tile_sync();
    if (tile_lane() == 0) {
        env->driven_tick = tick;
    }
    for (int i = env->shape.actions + tile_lane(); i < env->shape.joints; i += TILE) {
        const double pose = robot->default_pose[i];
        const double now = pose + scale * (double)env->action[0][i];
        const double before = pose + scale * (double)env->action[1][i];
        const double next = driven_next(driven_goal(env, def, robot, tick, i), now, before);
        env->action[2][i] = env->action[1][i];
        env->action[1][i] = env->action[0][i];
        env->action[0][i] = driven_action(def, robot, i, next);
    }
    tile_sync();
}

#endif
