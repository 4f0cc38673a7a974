/* An environment on the CPU: its block, and the policy step around the physics of RobotSim. */
#include <assert.h>
#include <math.h>
#include <string.h>

#include "env/task/ground.h"
#include "env/task/task.h"

/* ---- the block ---- */

static size_t history_bytes(const TaskShape *shape) {
    return task_whole_lines((size_t)shape->history * sizeof(float));
}

/* Of all but the ground memory and what follows it. */
static size_t front_bytes(const TaskShape *shape, uint32_t held) {
    return task_env_head_bytes(shape, held) + task_whole_lines(sizeof(TaskRest)) +
           history_bytes(shape);
}

size_t task_env_bytes(const TaskDef *def, const Robot *robot) {
    TaskShape shape = task_shape(def, robot);
    return front_bytes(&shape, task_frames_held(def)) +
           mild_ground_bytes_imprints(robot_soles(robot), robot_bodies(robot), def->imprint_tiles) +
           (def->motors ? def->motors->bytes : 0);
}

TaskRest *task_env_rest(TaskEnv *env) {
    return (TaskRest *)(void *)((char *)env + task_env_head_bytes(&env->shape, env->held));
}

static const TaskRest *rest_of(const TaskEnv *env) {
    return (const TaskRest *)(const void *)((const char *)env +
                                            task_env_head_bytes(&env->shape, env->held));
}

const MildTerrain *task_env_terrain(const TaskEnv *env) {
    return &rest_of(env)->terrain;
}

float *task_env_history(TaskEnv *env) {
    return (float *)(void *)((char *)task_env_rest(env) + task_whole_lines(sizeof(TaskRest)));
}

const float *task_env_frame(TaskEnv *env) {
    return task_env_history(env) + (TASK_FRAMES - 1) * (size_t)env->shape.observation;
}

MildGround *task_env_ground(TaskEnv *env) {
    return (MildGround *)(void *)((char *)env + front_bytes(&env->shape, env->held));
}

/* State of TaskDef.motors. */
static void *motors_of(TaskEnv *env) {
    MildGround *ground = task_env_ground(env);
    return (char *)ground + mild_ground_size(ground);
}

void task_env_init(TaskEnv *env, const TaskDef *def, const Robot *robot, uint64_t seed,
                   uint32_t index) {
    const TaskShape shape = task_shape(def, robot);
    TaskGains gains;
    MildStatus status = task_gains(def, robot, &gains, NULL);
    assert(status == MILD_OK); /* task_def_check_robot has seen them */
    (void)status;
    memset(env, 0, front_bytes(&shape, task_frames_held(def)));
    task_env_init_head(env, def, shape, seed, index);
    task_env_rest(env)->gains = gains;
    mild_ground_init_imprints(task_env_ground(env), robot_soles(robot), robot_bodies(robot),
                              def->imprint_tiles);
}

/* ---- the robot's state ---- */

RobotState task_env_state(const TaskEnv *env) {
    RobotState state;
    memcpy(state.qpos, env->robot.qpos, sizeof state.qpos);
    memcpy(state.qvel, env->robot.qvel, sizeof state.qvel);
    memcpy(state.qacc, rest_of(env)->qacc, sizeof state.qacc);
    return state;
}

void task_env_set_state(TaskEnv *env, const RobotState *state) {
    memcpy(env->robot.qpos, state->qpos, sizeof state->qpos);
    memcpy(env->robot.qvel, state->qvel, sizeof state->qvel);
    memcpy(task_env_rest(env)->qacc, state->qacc, sizeof state->qacc);
}

RobotVariation task_env_variation(const TaskEnv *env) {
    const TaskVariation *from = &env->variation;
    RobotVariation variation;
    memset(&variation, 0, sizeof variation); /* with its padding: robot_sim_load compares bytes */
    variation.base_mass_add = from->base_mass_add;
    memcpy(variation.com_offset, from->com_offset, sizeof variation.com_offset);
    memcpy(variation.link_mass_scale, from->link_mass_scale, sizeof variation.link_mass_scale);
    variation.armature_scale = from->armature_scale;
    variation.rigid_friction = from->rigid_friction;
    variation.rigid_time = from->rigid_time;
    variation.rigid = from->rigid;
    variation.shells_stand = from->shells_stand;
    return variation;
}

void task_env_load(const TaskEnv *env, RobotSim *sim) {
    const RobotState state = task_env_state(env);
    const RobotVariation variation = task_env_variation(env);
    robot_sim_load(sim, &state, &variation);
}

static void store(const RobotSim *sim, TaskEnv *env) {
    RobotState state;
    robot_sim_store(sim, &state);
    task_env_set_state(env, &state);
}

void task_env_read(const TaskEnv *env, const RobotSim *sim, RobotReading *reading) {
    const MildTerrain *terrain = task_env_terrain(env);
    const double *at = robot_sim_qpos(sim);
    memset(reading, 0, sizeof *reading);
    memcpy(reading->rotation, robot_sim_base_rotation(sim), sizeof reading->rotation);
    for (int f = 0; f < env->shape.feet; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        memcpy(reading->foot[f].force, foot->force, sizeof foot->force);
        memcpy(reading->foot[f].sole_center, foot->sole_center, sizeof foot->sole_center);
        memcpy(reading->foot[f].sole_center_velocity, foot->sole_center_velocity,
               sizeof foot->sole_center_velocity);
        reading->foot[f].sole_height = foot->sole_height;
        reading->foot[f].depth_mean = foot->result.depth_mean;
    }
    reading->body_clearance = robot_sim_body_clearance(sim, terrain);
    reading->base_clearance = robot_sim_base_clearance(sim, terrain);
    reading->knee_distance = robot_sim_knee_distance(sim);
    reading->foot_distance = robot_sim_foot_distance(sim);
    reading->above = at[2] - mild_terrain_height_at(terrain, at[0], at[1]);
}

/* ---- episodes ---- */

static void lend_map(TaskEnv *env, const TaskDef *def) {
    task_env_rest(env)->terrain.map = def->map;
}

static void return_map(TaskEnv *env) {
    task_env_rest(env)->terrain.map = NULL;
}

/* On uneven ground the lowest sole point starts at the depth that both soles have on level ground;
 * a robot that is dropped starts with its lowest point at the height of the drop. */
static void place(TaskEnv *env, const Robot *robot, RobotSim *sim) {
    const MildTerrain *terrain = task_env_terrain(env);
    double level = env->robot.qpos[2] - terrain->height - robot_stand_height(robot);
    task_env_load(env, sim);
    double lowest = robot_sim_sole_clearance(sim, terrain);
    if (env->dropped) {
        lowest = fmin(lowest, robot_sim_body_clearance(sim, terrain));
    }
    env->robot.qpos[2] += level - lowest;
}

/* The numbers of a scan [shape.scan]. */
static void read_scan(TaskEnv *env, const TaskDef *def, const Robot *robot, const TaskScan *scan,
                      float *to) {
    const MildTerrain *terrain = task_env_terrain(env);
    const MildGround *ground = task_env_ground(env);
    const double *at = scan->pose.at;
    for (int n = 0; n < env->shape.scan; n++) {
        double way[2];
        task_scan_point(def, scan, n, way);
        const double x = at[0] + way[0], y = at[1] + way[1];
        double height = mild_terrain_height_at(terrain, x, y) - at[2];
        if (def->imprint_tiles > 0 && !env->variation.rigid) {
            const int material = mild_terrain_material_at(terrain, x, y);
            height -=
                (1 - terrain->materials[material].recovery) * mild_ground_imprint_at(ground, x, y);
        }
        to[n] = task_scan_number(env, def, robot_table(robot), scan, n, height);
    }
}

/* Behind what task_observe has written. */
static void observe_ground(TaskEnv *env, const TaskDef *def, const Robot *robot,
                           const RobotReading *reading, const EnvsView *view) {
    const TaskShape *shape = &env->shape;
    task_scan_keep(env, reading);
    const TaskScan seen = task_scan_seen(env, def);
    read_scan(env, def, robot, &seen, view->history + shape->history - shape->scan);
    if (view->critic) {
        const TaskScan now = task_scan_true(env, reading);
        read_scan(env, def, robot, &now, view->critic + shape->critic - shape->scan);
    }
}

/* Into the block's history, of which the view has a copy. */
static void observe(TaskEnv *env, const TaskDef *def, const Robot *robot,
                    const RobotReading *reading, const TaskSensors *sensors, int first,
                    const EnvsView *view) {
    const MildTerrain *terrain = task_env_terrain(env);
    const double *at = env->robot.qpos;
    float ground[TASK_GROUND_NUMBERS];
    EnvsView own = *view;
    own.history = task_env_history(env);
    if (view->critic) {
        const int material = mild_terrain_material_at(terrain, at[0], at[1]);
        task_ground_numbers(robot, &terrain->materials[material], ground);
    }
    task_observe(env, def, robot_table(robot), reading, ground, sensors, first, &own);
    if (env->shape.scan > 0) {
        observe_ground(env, def, robot, reading, &own);
    }
    if (view->history) {
        memcpy(view->history, own.history, (size_t)env->shape.history * sizeof *own.history);
    }
}

void task_env_observe(TaskEnv *env, const TaskDef *def, const Robot *robot, const RobotSim *sim,
                      const TaskSensors *sensors, int first, const EnvsView *view) {
    RobotReading reading = {.above = 0};
    if (sim) {
        task_env_read(env, sim, &reading);
    }
    observe(env, def, robot, &reading, sensors, first, view);
}

void task_env_draw(TaskEnv *env, const TaskDef *def, const Robot *robot) {
    Random r = task_draw_contact(env, def);
    task_draw_ground(env, def, robot, &r);
    task_draw_robot(env, def, r);
    if (def->map) {
        Random place = task_map_random(env);
        task_draw_on_map(env, def, robot, &place);
    }
}

static void start_episode(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                          const EnvsView *view) {
    mild_ground_reset(task_env_ground(env));
    if (def->motors) {
        memset(motors_of(env), 0, def->motors->bytes);
    }
    lend_map(env, def);
    const MildTerrain *terrain = task_env_terrain(env);
    const MildMaterial *material = &terrain->materials[mild_terrain_material_at(terrain, 0, 0)];
    double depth = env->variation.rigid ? 0 : task_standing_depth(robot, material);
    task_begin_episode(env, def, robot_table(robot), terrain->height, depth);
    memset(task_env_rest(env)->qacc, 0, sizeof task_env_rest(env)->qacc);
    if (env->dropped || (terrain->map && !mild_map_is_level(terrain->map))) {
        place(env, robot, sim);
    }
    task_env_load(env, sim);
    robot_sim_sole_clearance(sim, terrain);
    RobotReading reading = {.above = 0};
    TaskSensors sensors = {0};
    task_env_read(env, sim, &reading);
    task_first_sensors(env, &reading, &sensors);
    observe(env, def, robot, &reading, &sensors, 1, view);
    return_map(env);
}

void task_env_reset(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                    const EnvsView *view) {
    task_env_draw(env, def, robot);
    start_episode(env, def, robot, sim, view);
}

void task_env_reset_on(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                       const MildTerrain *terrain, int rigid, const EnvsView *view) {
    task_env_draw(env, def, robot);
    task_env_rest(env)->terrain = *terrain;
    env->variation.rigid = rigid;
    env->variation.rigid_friction = TASK_RIGID_FRICTION;
    env->variation.rigid_time = 0;
    start_episode(env, def, robot, sim, view);
}

/* A torque within the limits of the motor: that of a motor whose PD asks for it. */
static double limited(const TaskMotor *motor, double torque, double qd) {
    const TaskMotor asked = {.target = {torque},
                             .kp = 1,
                             .limit = motor->limit,
                             .fastest = motor->fastest,
                             .full = motor->full};
    return task_torque(&asked, 0, 0, qd);
}

/* Torques of the drive within the limits of the motors. */
static void drive_torque(const TaskEnv *env, const TaskDrive *drive, RobotSim *sim,
                         const TaskMotor *motor, double *torque) {
    const double *qd = robot_sim_qvel(sim) + 6;
    drive->torque(drive->context, env, sim, torque);
    for (int i = 0; i < env->shape.joints; i++) {
        torque[i] = limited(&motor[i], torque[i], qd[i]);
    }
}

/* Torques of the joints at angles q and speeds qd: of their PD, or of TaskDef.motors, which sees
 * every step. act, late: bool, see task_motors_act and task_torque. */
static void joint_torque(TaskEnv *env, const TaskDef *def, const TaskMotor *motor, int act,
                         int late, const double *q, const double *qd) {
    double error[ROBOT_JOINTS_MAX], asked[ROBOT_JOINTS_MAX];
    if (def->motors) {
        for (int i = 0; i < env->shape.joints; i++) {
            error[i] = task_is_limp(env, def) ? 0 : motor[i].target[late] - q[i];
        }
        def->motors->torque(def->motors->self, motors_of(env), error, qd, asked);
    }
    for (int i = 0; act && i < env->shape.joints; i++) {
        env->torque[i] = def->motors ? limited(&motor[i], env->strength * asked[i], qd[i])
                                     : task_torque(&motor[i], late, q[i], qd[i]);
    }
}

/* Physics steps of one policy period, with the three latencies. Returns 1 when the simulation
 * diverged. */
static int run_physics(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                       TaskSensors *sensors, const TaskCallback *callback) {
    int steps = (int)(TASK_PERIOD / def->physics_dt + 0.5);
    const RobotTable *table = robot_table(robot);
    const TaskRest *rest = rest_of(env);
    TaskMotor motor[ROBOT_JOINTS_MAX] = {0};
    for (int i = 0; i < env->shape.joints; i++) {
        motor[i] = task_motor(env, def, table, &rest->gains, i);
    }
    for (int k = 0; k <= steps; k++) {
        const double *rotation = robot_sim_base_rotation(sim), *qvel = robot_sim_qvel(sim);
        const double *q = robot_sim_qpos(sim) + 7;
        if (k == steps - env->lag_imu) {
            task_read_imu(rotation, qvel, sensors);
        }
        if (k == steps - env->lag_motor) {
            task_read_motors(q, qvel + 6, sensors);
        }
        if (k == steps) {
            break;
        }
        joint_torque(env, def, motor, task_motors_act(env, def, k, steps), k < env->lag_command, q,
                     qvel + 6);
        if (callback && callback->drive) {
            drive_torque(env, callback->drive, sim, motor, env->torque);
        }
        double wrench[6];
        int helped = task_assist(env, def, table, rotation, qvel, wrench);
        if (robot_sim_step(sim, env->torque, helped ? wrench : NULL, &rest->terrain,
                           task_env_ground(env))) {
            return 1;
        }
        if (callback) {
            callback->physics_step(callback->context, env, sim, env->torque);
        }
    }
    return 0;
}

TaskStep task_env_step(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                       const float *action, int auto_reset, const EnvsView *view,
                       const TaskCallback *callback) {
    TaskSensors sensors = {0};
    RobotReading reading = {.above = 0};
    task_begin_step(env, def, robot_table(robot), action);
    lend_map(env, def);
    robot_sim_set_solver(sim, (MildSolver)def->solver, def->contact_tolerance,
                         def->contact_iterations);
    task_env_load(env, sim);
    int diverged = run_physics(env, def, robot, sim, &sensors, callback);
    if (!diverged) {
        store(sim, env);
        task_env_read(env, sim, &reading);
    }
    TaskStep out = task_end_step(env, def, robot_table(robot), &reading, env->torque, diverged);
    if (out.done && auto_reset) {
        task_env_reset(env, def, robot, sim, view);
    } else if (out.valid) {
        observe(env, def, robot, &reading, &sensors, 0, view);
    }
    return_map(env);
    return out;
}
