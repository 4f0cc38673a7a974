/* An environment on the CPU: its block, and the policy step around the physics of RobotSim. */
#include <assert.h>
#include <string.h>

#include "env/task/task.h"

size_t task_env_bytes(const TaskDef *def, const Robot *robot) {
    TaskShape shape = task_shape(robot);
    return task_env_head_bytes(&shape, task_frames_held(def)) +
           mild_ground_bytes_imprints(robot_soles(robot), shape.feet, def->print_tiles) +
           (def->motors ? def->motors->bytes : 0);
}

MildGround *task_env_ground(TaskEnv *env) {
    return (MildGround *)(void *)((char *)env + task_env_head_bytes(&env->shape, env->held));
}

void *task_env_motors(TaskEnv *env) {
    MildGround *ground = task_env_ground(env);
    return (char *)ground + mild_ground_size(ground);
}

void task_env_init(TaskEnv *env, const TaskDef *def, const Robot *robot, uint64_t seed,
                   uint32_t index) {
    const TaskShape shape = task_shape(robot);
    TaskGains gains = {{0}, {0}};
    MildStatus status = task_gains(def, robot, gains.kp, gains.kd, NULL);
    assert(status == MILD_OK); /* task_def_check_robot has seen them */
    (void)status;
    task_env_init_head(env, def, shape, &gains, seed, index);
    mild_ground_init_imprints(task_env_ground(env), robot_soles(robot), env->shape.feet,
                              def->print_tiles);
}

static void lend_map(TaskEnv *env, const TaskDef *def) {
    env->terrain.map = def->map;
}

static void return_map(TaskEnv *env) {
    env->terrain.map = NULL;
}

/* On uneven ground the lowest sole point starts at the depth that both soles have on level
 * ground. */
static void start_on_map(TaskEnv *env, const Robot *robot, RobotSim *sim) {
    double level = env->robot.qpos[2] - env->terrain.height - robot_stand_height(robot);
    robot_sim_load(sim, &env->robot, &env->variation);
    env->robot.qpos[2] += level - robot_sim_sole_clearance(sim, &env->terrain);
}

static void start_episode(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                          const TaskView *view) {
    mild_ground_reset(task_env_ground(env));
    if (def->motors) {
        memset(task_env_motors(env), 0, def->motors->bytes);
    }
    lend_map(env, def);
    const MildMaterial *material =
        &env->terrain.materials[mild_terrain_material_at(&env->terrain, 0, 0)];
    double depth = env->variation.rigid ? 0 : task_standing_depth(robot, material);
    task_begin_episode(env, def, robot, depth);
    if (env->terrain.map && !mild_map_is_level(env->terrain.map)) {
        start_on_map(env, robot, sim);
    }
    robot_sim_load(sim, &env->robot, &env->variation);
    robot_sim_sole_clearance(sim, &env->terrain);
    TaskReading reading;
    task_first_reading(env, sim, &reading);
    task_observe(env, def, robot, sim, &reading, 1, view);
    return_map(env);
}

void task_env_reset(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                    const TaskView *view) {
    task_randomize(env, def, robot);
    start_episode(env, def, robot, sim, view);
}

void task_env_reset_on(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                       const MildTerrain *terrain, int rigid, const TaskView *view) {
    task_randomize(env, def, robot);
    env->terrain = *terrain;
    env->variation.rigid = rigid;
    env->variation.rigid_friction = TASK_RIGID_FRICTION;
    env->variation.rigid_time = 0;
    start_episode(env, def, robot, sim, view);
}

/* A torque within the limits of the motor: that of a motor whose PD asks for it. */
static double limited(const TaskMotor *motor, double torque, double qd) {
    const TaskMotor asked = {
        .target = {torque}, .kp = 1, .limit = motor->limit, .fastest = motor->fastest};
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
            error[i] = motor[i].target[late] - q[i];
        }
        def->motors->torque(def->motors->self, task_env_motors(env), error, qd, asked);
    }
    for (int i = 0; act && i < env->shape.joints; i++) {
        env->torque[i] = def->motors ? limited(&motor[i], env->strength[i] * asked[i], qd[i])
                                     : task_torque(&motor[i], late, q[i], qd[i]);
    }
}

/* Physics steps of one policy period, with the three latencies. Returns 1 when the simulation
 * diverged. */
static int run_physics(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                       TaskReading *reading, const TaskProbe *probe) {
    int steps = (int)(TASK_PERIOD / def->physics_dt + 0.5);
    TaskMotor motor[ROBOT_JOINTS_MAX];
    for (int i = 0; i < env->shape.joints; i++) {
        motor[i] = task_motor(env, def, robot, i);
    }
    for (int k = 0; k <= steps; k++) {
        if (k == steps - env->lag_imu) {
            task_read_imu(sim, reading);
        }
        if (k == steps - env->lag_motor) {
            task_read_motors(sim, reading);
        }
        if (k == steps) {
            break;
        }
        const double *q = robot_sim_qpos(sim) + 7, *qd = robot_sim_qvel(sim);
        joint_torque(env, def, motor, task_motors_act(env, def, k, steps), k < env->lag_command, q,
                     qd + 6);
        if (probe && probe->drive) {
            drive_torque(env, probe->drive, sim, motor, env->torque);
        }
        double wrench[6];
        int helped = task_assist(env, def, robot, robot_sim_base_rotation(sim), qd, wrench);
        if (robot_sim_step(sim, env->torque, helped ? wrench : NULL, &env->terrain,
                           task_env_ground(env))) {
            return 1;
        }
        if (probe) {
            probe->physics_step(probe->context, env, sim, env->torque);
        }
    }
    return 0;
}

TaskStep task_env_step(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                       const float *action, int auto_reset, const TaskView *view,
                       const TaskProbe *probe) {
    TaskReading reading;
    task_begin_step(env, def, action);
    lend_map(env, def);
    robot_sim_set_solver(sim, def->newton ? MILD_SOLVER_NEWTON : MILD_SOLVER_GAUSS_SEIDEL,
                         def->contact_tolerance, def->contact_iterations);
    robot_sim_load(sim, &env->robot, &env->variation);
    int diverged = run_physics(env, def, robot, sim, &reading, probe);
    if (!diverged) {
        robot_sim_store(sim, &env->robot);
    }
    TaskStep out = task_end_step(env, def, robot, sim, env->torque, diverged);
    if (out.done && auto_reset) {
        task_env_reset(env, def, robot, sim, view);
    } else if (out.valid) {
        task_observe(env, def, robot, sim, &reading, 0, view);
    }
    return_map(env);
    return out;
}
