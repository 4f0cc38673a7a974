/* A policy step of one environment in the batch engine, compiled for the CPU by batch_host.c and
 * for a GPU by batch_device.cu, for any robot or for one size alone.
 *
 *     env_part(0)      a warp: action, and the first physics step up to the ground
 *     env_shells_step  a team: the ground under robots with shells near it, where shells stand; on
 *                      rigid ground env_floor_step, a warp, as env_part(1) would do it
 *     mild_batch_step    the ground under the others
 *     env_part(1)      a warp: the rest of that physics step, the next one up to the ground
 *     ...
 *     env_part(steps)  a warp: the rest of the last physics step, what the task asks of the pose
 *     env_end          a few threads: reward, clock; the next episode where this one ended
 *     env_pose         a warp: the pose in which an episode begins
 *     env_observe      a few threads: the observation
 *
 * Engine and ground are kernels of their own, because a GPU reads its instructions from a small
 * cache, and the two together are far too large for it. */
#ifndef ENVS_BATCH_STEP_H
#define ENVS_BATCH_STEP_H

#include "env/batch_env.h"
#include "env/batch_sample.h"
#include "env/batch_shells.h"
#include "env/kernels.h"
#include "env/task/step.h"
#include "robot/engine/measure.h"
#include "robot/engine/step.h"

/* [B] Of a TaskEnv, its frames and poses. */
MILD_HD size_t env_stride(const TaskDef *def, const TaskShape *shape) {
    return task_env_head_bytes(shape, task_frames_held(def));
}

/* ---- ground of an episode ---- */

MILD_HD_FN void env_draw_label(const EnvsTask *task, TaskEnv *env, Random *r, int label) {
    env->ground[label] = (int)random_index(r, (uint32_t)task->grounds);
}

/* As task_draw_ground of the CPU, but that stripes are labels of the map: EnvsTask.striped. */
MILD_HD_FN void env_draw_ground(const EnvsTask *task, TaskEnv *env, Random *r) {
    env_draw_label(task, env, r, 0);
    const int striped = random_unit(r) < task->task.randomize.patch_share;
    for (int label = 1; task->striped && label < task->labels; label++) {
        env->ground[label] = env->ground[0];
        if (striped) {
            env_draw_label(task, env, r, label);
        }
    }
}

/* As task_draw_on_map of the CPU. origin: [2] [m] */
MILD_HD_FN void env_draw_on_map(const EnvsTask *task, TaskEnv *env, Real *origin) {
    Random r = task_map_random(env);
    origin[0] = (Real)task_spread(&r, 0.5 * task->map_extent[0]);
    origin[1] = (Real)task_spread(&r, 0.5 * task->map_extent[1]);
    for (int label = 1; !task->striped && label < task->labels; label++) {
        env_draw_label(task, env, &r, label);
    }
}

/* Draws all of an episode but its start. */
MILD_HD_FN void env_draw(const EnvsArrays *all, long robot, TaskEnv *env) {
    const EnvsTask *task = all->task;
    Real *origin = all->map_origin + 2 * robot;
    Random r = task_draw_contact(env, &task->task);
    env_draw_ground(task, env, &r);
    task_draw_robot(env, &task->task, r);
    origin[0] = origin[1] = 0;
    if (task->task.map) {
        env_draw_on_map(task, env, origin);
    }
    tile_sync();
}

/* ---- from and to TaskEnv ---- */

WARP_FN void env_load(const EngineModel *model, const TaskEnv *env, EnvWork *scratch) {
    const int joints = model->tree.joints;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = LANE(l); i < 7 + joints; i += LANES) {
            scratch->qpos[i] = (Real)env->robot.qpos[i];
        }
        LANE_ROLLED
        for (int i = LANE(l); i < 6 + joints; i += LANES) {
            scratch->qvel[i] = (Real)env->robot.qvel[i];
        }
    }
    lanes_sync();
    engine_load(model, scratch->qpos, scratch->qvel, &scratch->work);
}

WARP_FN void env_store(const EngineModel *model, EnvWork *scratch, TaskEnv *env) {
    const int joints = model->tree.joints;
    engine_store(model, &scratch->work, scratch->qpos, scratch->qvel);
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = LANE(l); i < 7 + joints; i += LANES) {
            env->robot.qpos[i] = scratch->qpos[i];
        }
        LANE_ROLLED
        for (int i = LANE(l); i < 6 + joints; i += LANES) {
            env->robot.qvel[i] = scratch->qvel[i];
        }
    }
    lanes_sync();
}

/* What sensors read now, as task_read_imu and task_read_motors. */
WARP_FN void env_read(const EngineModel *model, const TaskEnv *env, int steps_left,
                      const EngineWork *work, TaskSensors *sensors) {
    const EngineTree *tree = &model->tree;
    EACH_LANE(l) {
        if (steps_left == env->lag_imu && LANE(l) == 0) {
            Real R[9];
            quaternion_matrix(work->quaternion, R);
            for (int k = 0; k < 3; k++) {
                sensors->omega[k] = work->rate[3 + k];
                sensors->gravity[k] = -R[6 + k];
            }
        }
        LANE_ROLLED
        for (int i = 1 + LANE(l); steps_left == env->lag_motor && i < engine_links(tree);
             i += LANES) {
            sensors->q[tree->joint[i]] = work->angle[i];
            sensors->qd[tree->joint[i]] = work->rate[5 + i];
        }
    }
    lanes_sync();
}

/* ---- physics ---- */

/* Force and torque of the assistance, by one lane. */
MILD_HD void env_assist(const EnvsTask *task, const TaskEnv *env, EnvWork *scratch) {
    const EngineWork *work = &scratch->work;
    Real R[9];
    Real wrench[6];
    quaternion_matrix(work->quaternion, R);
    task_assist(env, &task->task, &task->robot, R, work->rate, wrench);
    for (int d = 0; d < 6; d++) {
        scratch->base_wrench[d] = wrench[d];
    }
}

/* Torques of the motors and the push of the assistance. late, act: bool, see task_torque. */
WARP_FN void env_motors(const EnvsArrays *all, const TaskEnv *env, int late, int act, int helped,
                        EnvWork *scratch) {
    const EngineTree *tree = &all->model->tree;
    const EngineWork *work = &scratch->work;
    EACH_LANE(l) {
        LANE_ROLLED
        for (int i = 1 + LANE(l); i < engine_links(tree); i += LANES) {
            const int j = tree->joint[i];
            scratch->torque[j] =
                act ? (Real)task_torque(&scratch->motor[j], late, work->angle[i], work->rate[5 + i])
                    : env->torque[j];
        }
        if (helped && LANE(l) == LANES - 1) {
            env_assist(all->task, env, scratch);
        }
    }
    lanes_sync();
}

/* The lower triangle of A. */
WARP_FN void env_export_inertia(const Real *A, int rows, Real *to) {
    EACH_LANE(l) {
        ENGINE_LOOP
        for (int i = LANE(l); i < rows * rows; i += LANES) {
            const int row = i / rows, column = i % rows;
            if (column <= row) {
                to[contact_triangle(row, column)] = A[i];
            }
        }
    }
}

/* What the ground reads. */
WARP_FN void env_export(const EnvsArrays *all, long robot, const EngineWork *work) {
    const int feet = engine_feet(&all->model->tree);
    const EnvsContact *at = &all->contact;
    const EngineSupport *support = &work->now.support;
    env_copy(work->foot_position[0], 3 * feet, at->position + robot * 3 * feet);
    env_copy(work->foot_rotation[0], 9 * feet, at->rotation + robot * 9 * feet);
    env_copy(work->foot_velocity[0], 6 * feet, at->velocity + robot * 6 * feet);
    env_export_inertia(support->ground.inverse_inertia, 6 * feet,
                       at->inverse_inertia + robot * contact_triangle(6 * feet, 0));
    env_copy(support->free_velocity[0], 6 * feet, at->free_velocity + robot * 6 * feet);
}

/* What the ground did. */
WARP_FN void env_import(const EnvsArrays *all, long robot, EngineWork *work) {
    const int feet = engine_feet(&all->model->tree);
    env_copy(all->contact.velocity + robot * 6 * feet, 6 * feet, work->wrench[0]);
    lanes_sync();
}

MILD_HD void env_measure_foot(const EngineModel *model, const EnvWork *scratch, int f, int contact,
                              Real lowest, Real depth, RobotReading *reading) {
    const EngineWork *work = &scratch->work;
    Real center[3], velocity[3];
    sole_center(model, work, f, center, velocity);
    for (int k = 0; k < 3; k++) {
        reading->foot[f].sole_center[k] = center[k];
        reading->foot[f].sole_center_velocity[k] = velocity[k];
        reading->foot[f].force[k] = contact ? work->wrench[f][k] : 0;
    }
    reading->foot[f].depth_mean = contact ? depth : 0;
    reading->foot[f].sole_height = lowest;
}

/* What the task asks of the pose. contact: bool, with forces and torques of the last physics
 * step. */
WARP_FN void env_measure(const EnvsArrays *all, long robot, int contact, EnvWork *scratch) {
    EnvRobot *own = env_robot_at(all, robot);
    RobotReading *reading = env_reading(own);
    const EngineModel *model = all->model;
    const EngineWork *work = &scratch->work;
    const int feet = engine_feet(&model->tree);
    const EngineGround ground = env_surface(all, robot);
    Real lowest[LANE_COPIES]; /* of the lane's foot */
    LANE_ROLLED
    for (int f = 0; f < feet; f++) {
        const Real sole = engine_sole_height_on(model, work, f, &ground);
        EACH_LANE(l) {
            lowest[l] = f > 0 && LANE(l) != f ? lowest[l] : sole;
        }
    }
    EACH_LANE(l) {
        if (LANE(l) < feet) {
            env_measure_foot(model, scratch, LANE(l), contact, lowest[l],
                             all->contact.foot[robot * feet + LANE(l)].depth_mean, reading);
        }
    }
    const EngineClearance clearance = engine_clearance_on(model, work, &ground);
    EACH_LANE(l) {
        if (LANE(l) == 0) {
            reading->body_clearance = clearance.body;
            reading->base_clearance = clearance.base;
        }
        if (LANE(l) == 3) {
            const MapSpot spot = engine_spot(&ground, work);
            reading->above = work->base[2] - engine_surface(&ground, work, &spot, 0, 0).height;
            own->label = ground.map ? map_label_near(ground.map, &spot, 0, 0) : 0;
        }
        if (LANE(l) == 1) {
            reading->knee_distance = knee_distance(model, work);
        }
        if (LANE(l) == 2) {
            reading->foot_distance = foot_distance(model, work);
        }
        for (int k = LANE(l); k < 9; k += LANES) {
            reading->rotation[k] = work->rotation[0][k];
        }
    }
    lanes_sync();
}

/* The part of a policy step before physics: the action counts. */
WARP_FN void env_act(const EnvsArrays *all, const EnvsStep *call, long robot, TaskEnv *env) {
    EACH_LANE(l) {
        if (LANE(l) < TILE) {
            task_begin_step(env, &all->task->task, &all->task->robot,
                            call->action + robot * env->shape.actions);
        }
        if (LANE(l) == 0) {
            env_robot_at(all, robot)->diverged = 0;
        }
    }
    lanes_sync();
}

/* From the ground's forces to the next state. solved: bool, by env_floor_step. */
WARP_FN int env_finish_step(const EnvsArrays *all, long robot, const TaskEnv *env, int solved,
                            EnvWork *scratch) {
    const EngineModel *model = all->model;
    EngineWork *work = &scratch->work;
    const int rigid = env->variation.rigid;
    const int feet = engine_feet(&model->tree);
    if (rigid && !solved) {
        const EngineGround ground = env_surface(all, robot);
        env_rigid(model, env_contact(&env->variation), &ground, scratch);
    } else {
        env_import(all, robot, work);
    }
    const int bad = solved ? engine_integrate(model, work) : engine_end(model, rigid, work);
    EACH_LANE(l) {
        if (rigid && !solved && LANE(l) < feet) {
            all->contact.foot[robot * feet + LANE(l)].depth_mean =
                env_corner_depth(model, scratch, LANE(l));
        }
        if (bad && LANE(l) == 0) {
            env_robot_at(all, robot)->diverged = 1;
        }
    }
    lanes_sync();
    return bad;
}

/* Numbers lane, lane + LANES ... of what differs from robot to robot. */
MILD_HD void env_vary(const TaskVariation *from, EngineVariation *to, int links, int lane) {
    if (lane == 0) {
        to->base_mass_add = from->base_mass_add;
        to->armature_scale = from->armature_scale;
        to->rigid = env_contact(from);
    }
    for (int k = lane; k < 3; k += LANES) {
        to->center_offset[k] = from->com_offset[k];
    }
    for (int i = lane; i < links; i += LANES) {
        to->link_mass_scale[i] = from->link_mass_scale[i];
    }
}

/* Physics step k up to the ground; with k = steps the pose alone. */
WARP_FN void env_start_step(const EnvsArrays *all, long robot, int k, int steps, const TaskEnv *env,
                            EnvWork *scratch) {
    const EngineModel *model = all->model;
    const EnvsTask *task = all->task;
    const int helped = task_assist_share(env, &task->task) != 0;
    const EngineAction action = {&scratch->variation, scratch->torque,
                                 helped ? scratch->base_wrench : NULL, env->variation.rigid};
    env_read(model, env, steps - k, &scratch->work, &env_robot_at(all, robot)->sensors);
    if (k < steps) {
        EACH_LANE(l) {
            LANE_ROLLED
            for (int j = LANE(l); j < env->shape.joints; j += LANES) {
                scratch->motor[j] = task_motor(env, &task->task, &task->robot, &task->gains, j);
            }
            env_vary(&env->variation, &scratch->variation, 1 + env->shape.joints, LANE(l));
        }
        lanes_sync();
        env_motors(all, env, k < env->lag_command, task_motors_act(env, &task->task, k, steps),
                   helped, scratch);
    }
    engine_begin(model, k < steps ? &action : NULL, &scratch->work);
}

/* Bools and constants: sampled: with the samples of an evaluation; shells: they stand. */
WARP_FN void env_part(const EnvsArrays *all, const EnvsStep *call, long robot, int k, int sampled,
                      int shells, EnvWork *scratch) {
    TaskEnv *env = env_at(all, robot);
    EnvRobot *own = env_robot_at(all, robot);
    const EngineTree *tree = &all->model->tree;
    const int steps = env_physics_steps(all->task);
    int solved = 0;
    if (shells) {
        solved = env->variation.rigid && all->shells.near[robot];
        lanes_sync(); /* before lane 0 writes there */
        env_shells_away(all, robot, env->variation.rigid && !solved);
    }
    if (k == 0) {
        env_act(all, call, robot, env);
        env_load(all->model, env, scratch);
        engine_restore_acceleration(tree, &own->saved, &scratch->work);
    } else {
        if (own->diverged) {
            return;
        }
        engine_restore(tree, env->variation.rigid, &own->saved, &scratch->work);
        if (env_finish_step(all, robot, env, solved, scratch)) {
            return;
        }
    }
    env_start_step(all, robot, k, steps, env, scratch);
    if (k == steps) {
        env_store(all->model, scratch, env);
        engine_save_acceleration(tree, &scratch->work, &own->saved);
    }
    if (k == steps || (sampled && k > 0)) {
        env_measure(all, robot, 1, scratch);
    }
    if (sampled) {
        env_record_sample(all, robot, k, shells, scratch);
    }
    if (k < steps) {
        engine_save(tree, env->variation.rigid, &scratch->work, &own->saved);
        const int kept = k == steps - 1 || all->task->task.torque_hold;
        EACH_LANE(l) {
            LANE_ROLLED
            for (int j = LANE(l); kept && j < env->shape.joints; j += LANES) {
                env->torque[j] = scratch->torque[j];
            }
        }
        if (!env->variation.rigid) {
            env_export(all, robot, &scratch->work);
        }
        if (shells && env->variation.shells_stand) {
            const EngineGround ground = env_surface(all, robot);
            env_shells_near(all, robot, &ground, &scratch->work);
        }
    }
}

/* The pose in which an episode begins: see place of env/task/env.c. */
WARP_FN void env_pose(const EnvsArrays *all, long robot, EnvWork *scratch) {
    TaskEnv *env = env_at(all, robot);
    const EngineModel *model = all->model;
    const EngineGround ground = env_surface(all, robot);
    if (!all->reset[robot]) {
        return;
    }
    const int dropped = env->dropped;
    LANE_ROLLED
    for (int again = all->task->uneven || dropped; again >= 0; again--) {
        Real lowest = MEASURE_NONE;
        env_load(model, env, scratch);
        engine_begin(model, NULL, &scratch->work);
        LANE_ROLLED
        for (int f = 0; again && f < engine_feet(&model->tree); f++) {
            lowest = real_min(lowest, engine_sole_height_on(model, &scratch->work, f, &ground));
        }
        if (again && dropped) {
            lowest = real_min(lowest, engine_body_clearance_on(model, &scratch->work, &ground));
        }
        EACH_LANE(l) {
            if (again && LANE(l) == 0) {
                const double level = env->robot.qpos[2] - all->task->robot.stand_height;
                env->robot.qpos[2] += level - (double)lowest;
            }
        }
        lanes_sync();
    }
    env_measure(all, robot, 0, scratch);
}

/* ---- the task, by TILE threads ---- */

/* A new environment. */
MILD_HD void env_create(const EnvsArrays *all, long robot) {
    const EnvsTask *task = all->task;
    if (tile_lane() == 0) {
        memset(env_robot_at(all, robot), 0, sizeof(EnvRobot));
        task_env_init_head(env_at(all, robot), &task->task, task->shape, task->seed,
                           all->trial ? all->trial[robot].stream : task->first + (uint32_t)robot);
    }
}

/* To or from arrays.progress. */
MILD_HD void env_move_progress(const EnvsArrays *all, long robot, int back) {
    TaskEnv *env = env_at(all, robot);
    if (back) {
        task_set_progress(env, all->progress[robot]);
    } else {
        all->progress[robot] = task_progress(env);
    }
}

/* Label of the map at the world's origin, where episodes begin. */
MILD_HD int env_first_label(const EnvsArrays *all, long robot) {
    const Real origin[3] = {0, 0, 0};
    if (!all->task->has_map) {
        return 0;
    }
    const MapSpot spot = map_spot(&all->task->map, origin, all->map_origin + 2 * robot, 0);
    return map_label_near(&all->task->map, &spot, 0, 0);
}

/* Draws an episode. */
MILD_HD void env_begin(const EnvsArrays *all, long robot) {
    const EnvsTask *task = all->task;
    TaskEnv *env = env_at(all, robot);
    env_draw(all, robot, env);
    if (all->trial) {
        env_set_trial(all, robot, env);
    }
    for (int label = 0; label < task->labels; label++) {
        all->material[robot * task->labels + label] = env->ground[label];
    }
    const int ground = env->ground[env_first_label(all, robot)];
    task_begin_episode(env, &task->task, &task->robot, 0,
                       env->variation.rigid ? 0 : task->ground[ground].depth);
    tile_clear(env_robot_at(all, robot)->saved.state + ENGINE_ACCELERATION,
               (size_t)engine_dofs(&all->model->tree) * sizeof(Real));
    all->reset[robot] = 1;
    all->rigid[robot] = env->variation.rigid != 0;
    all->contact.height[robot] = env->variation.rigid ? -ENVS_FAR : 0;
}

MILD_HD void env_count(Real *tally, const TaskStep *step) {
    tally[TALLY_DIVERGED] += !step->valid;
    tally[TALLY_STEPS] += 1;
    tally[TALLY_PAID] += step->reward;
    if (!step->done) {
        return;
    }
    tally[TALLY_EPISODES] += 1;
    tally[TALLY_FALLS] += !step->timeout;
    tally[TALLY_LENGTH] += step->length * TASK_PERIOD;
    tally[TALLY_REWARD] += step->episode_reward;
    tally[TALLY_SPEED_ERROR] += step->episode_speed_error;
    for (int i = 0; i < TASK_REWARD_COUNT; i++) {
        tally[TALLY_TERMS + i] += step->episode_terms[i];
    }
}

/* Number n of the tally of an environment, which begins anew. */
MILD_HD double env_tally(const EnvsArrays *all, long robot, int n) {
    if (n == TALLY_ASSIST) {
        return task_assist_share(env_at(all, robot), &all->task->task);
    }
    Real *tally = env_robot_at(all, robot)->tally;
    const double number = tally[n];
    tally[n] = 0;
    return number;
}

MILD_HD void env_end(const EnvsArrays *all, const EnvsStep *call, long robot) {
    EnvRobot *own = env_robot_at(all, robot);
    TaskEnv *env = env_at(all, robot);
    const TaskStep step = task_end_step(env, &all->task->task, &all->task->robot, env_reading(own),
                                        env->torque, own->diverged);
    if (tile_lane() == 0) {
        call->reward[robot] = step.reward;
        call->done[robot] = step.done;
        call->timeout[robot] = step.timeout;
        call->valid[robot] = step.valid;
        if (call->cause) {
            call->cause[robot] = step.cause;
        }
        all->reset[robot] = step.done;
        env_count(own->tally, &step);
    }
    if (step.done) {
        env_begin(all, robot);
    }
}

/* The numbers of a scan [shape.scan]. The batch engine has no imprints. */
MILD_HD_FN void env_read_scan(const EnvsArrays *all, long robot, const TaskScan *scan, float *to) {
    const EnvsTask *task = all->task;
    const TaskEnv *env = env_at(all, robot);
    const Real *base = scan->pose.at;
    const EngineGround ground = env_surface(all, robot);
    const MapSpot spot = base_spot(&ground, base);
    for (int n = tile_lane(); n < task->shape.scan; n += TILE) {
        Real way[2];
        task_scan_point(&task->task, scan, n, way);
        const Real height = surface_under(&ground, base, &spot, way[0], way[1]).height - base[2];
        to[n] = task_scan_number(env, &task->task, &task->robot, scan, n, height);
    }
}

/* Behind what task_observe has written. */
MILD_HD_FN void env_observe_ground(const EnvsArrays *all, long robot, const EnvsView *view) {
    TaskEnv *env = env_at(all, robot);
    const TaskShape *shape = &all->task->shape;
    const RobotReading *reading = env_reading(env_robot_at(all, robot));
    task_scan_keep(env, reading);
    const TaskScan seen = task_scan_seen(env, &all->task->task);
    env_read_scan(all, robot, &seen, view->history + shape->history - shape->scan);
    if (view->critic) {
        const TaskScan now = task_scan_true(env, reading);
        env_read_scan(all, robot, &now, view->critic + shape->critic - shape->scan);
    }
}

MILD_HD void env_observe(const EnvsArrays *all, const EnvsStep *call, long robot) {
    TaskEnv *env = env_at(all, robot);
    const TaskShape *shape = &env->shape;
    EnvsView view = task_view_from(&call->next, shape, robot);
    view.history = call->next.history + robot * shape->history; /* never NULL */
    const int reset = all->reset[robot];
    EnvRobot *own = env_robot_at(all, robot);
    if (reset && tile_lane() == 0) {
        task_first_sensors(env, env_reading(own), &own->sensors);
    }
    tile_sync();
    task_observe(env, &all->task->task, &all->task->robot, env_reading(own),
                 all->task->ground[env->ground[own->label]].numbers, &own->sensors, reset, &view);
    if (shape->scan > 0) {
        env_observe_ground(all, robot, &view);
    }
}

/* ---- where they are ---- */

/* By a tile. */
MILD_HD void env_read_motion(const EnvsArrays *all, const EnvsMotion *motion, long robot) {
    const TaskEnv *env = env_at(all, robot);
    const int joints = env->shape.joints;
    for (int i = tile_lane(); motion->qpos && i < 7 + joints; i += TILE) {
        motion->qpos[robot * (7 + joints) + i] = (float)env->robot.qpos[i];
    }
    for (int i = tile_lane(); motion->qvel && i < 6 + joints; i += TILE) {
        motion->qvel[robot * (6 + joints) + i] = (float)env->robot.qvel[i];
    }
    for (int i = tile_lane(); motion->torque && i < joints; i += TILE) {
        motion->torque[robot * joints + i] = (float)env->torque[i];
    }
}

#endif
