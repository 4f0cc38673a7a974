/* The policy step, read top to bottom. */
#include <assert.h>
#include <math.h>
#include <string.h>

#include "base/random.h"
#include "task/task.h"

#define RANDOM_USE_START 0x53544152u
#define RANDOM_USE_PUSH 0x50555348u
#define CONTACT_FORCE 5.0 /* [N] */

/* ---- the block: TaskEnv, history, ring of frames, ground memory ---- */

static size_t whole_lines(size_t bytes) {
    return (bytes + 63) / 64 * 64;
}

static size_t frames_at(void) {
    return whole_lines(sizeof(TaskEnv));
}

static size_t ground_at(const TaskShape *shape) {
    int floats = shape->history + TASK_FRAMES_HELD * shape->observation;
    return frames_at() + whole_lines((size_t)floats * sizeof(float));
}

size_t task_env_bytes(const TaskDef *def, const Robot *robot) {
    TaskShape shape = task_shape(robot);
    return ground_at(&shape) +
           mild_ground_bytes_prints(robot_soles(robot), shape.feet, def->print_tiles);
}

MildGround *task_env_ground(TaskEnv *env) {
    return (MildGround *)(void *)((char *)env + ground_at(&env->shape));
}

float *task_env_history(TaskEnv *env) {
    return (float *)(void *)((char *)env + frames_at());
}

float *task_env_frame(TaskEnv *env, int age) {
    uint32_t place = (env->newest + TASK_FRAMES_HELD - (uint32_t)age) % TASK_FRAMES_HELD;
    return task_env_history(env) + env->shape.history + place * (uint32_t)env->shape.observation;
}

void task_env_init(TaskEnv *env, const TaskDef *def, const Robot *robot, uint64_t seed,
                   uint32_t index) {
    memset(env, 0, task_env_bytes(def, robot));
    env->shape = task_shape(robot);
    mild_ground_init_prints(task_env_ground(env), robot_soles(robot), env->shape.feet,
                            def->print_tiles);
    MildStatus status = task_gains(def, robot, env->kp, env->kd, NULL);
    assert(status == MILD_OK); /* task_def_check_robot has seen them */
    (void)status;
    env->seed = seed;
    env->index = index;
    env->step_limit = (uint32_t)(def->episode / TASK_PERIOD + 0.5);
    env->assist_level = 1;
}

static void lend_map(TaskEnv *env, const TaskDef *def) {
    env->terrain.map = def->map;
}

static void return_map(TaskEnv *env) {
    env->terrain.map = NULL;
}

/* ---- start of an episode ---- */

/* [m] Sinkage while standing, so that episodes start neither in the air nor buried. */
static double standing_depth(const Robot *robot, const MildMaterial *material) {
    return mild_sole_sinkage(robot_soles(robot)[0], material, robot_foot_load(robot));
}

static void draw_start(TaskEnv *env, const TaskDef *def, const Robot *robot) {
    const RandomizeDef *z = &def->randomize;
    Random r = random_at(env->seed ^ RANDOM_USE_START, env->index, env->tick);
    const double *pose = robot_default_pose(robot);
    memset(&env->robot, 0, sizeof env->robot);
    double yaw = env->command_frozen ? 0 : 3.141592653589793 * (2 * random_unit(&r) - 1);
    const MildMaterial *material =
        &env->terrain.materials[mild_terrain_material_at(&env->terrain, 0, 0)];
    double depth = env->variation.rigid ? 0 : standing_depth(robot, material);
    env->robot.qpos[2] = env->terrain.height + robot_stand_height(robot) - depth + 0.002;
    env->robot.qpos[3] = cos(0.5 * yaw);
    env->robot.qpos[6] = sin(0.5 * yaw);
    for (int i = 0; i < env->shape.joints; i++) {
        double q = pose[i] + z->initial_joint * (2 * random_unit(&r) - 1);
        env->robot.qpos[7 + i] =
            fmin(fmax(q, robot_joint_low(robot)[i]), robot_joint_high(robot)[i]);
    }
    for (int i = 0; i < 6; i++) {
        env->robot.qvel[i] = z->initial_velocity * (2 * random_unit(&r) - 1);
    }
    env->phase = random_unit(&r) < 0.5 ? 0 : 0.5;
    /* The first episodes end at different times, so that the environments do not reset in
     * lockstep. */
    env->step = env->tick == 0 && !env->command_frozen
                    ? (uint32_t)(random_unit(&r) * 0.9 * env->step_limit)
                    : 0;
    env->step_first = env->step;
}

static void base_twist(const RobotSim *sim, double twist[6]) {
    const double *qvel = robot_sim_qvel(sim);
    memcpy(twist, qvel, 6 * sizeof *twist);
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
    lend_map(env, def);
    draw_start(env, def, robot);
    if (env->terrain.map && !mild_map_is_level(env->terrain.map)) {
        start_on_map(env, robot, sim);
    }
    if (!env->command_frozen) {
        task_draw_command(env, def);
    }
    memcpy(env->command_seen, env->command, sizeof env->command);
    memset(env->action, 0, sizeof env->action);
    memset(env->air_time, 0, sizeof env->air_time);
    memset(env->joint_speed, 0, sizeof env->joint_speed);
    memset(env->smooth_velocity, 0, sizeof env->smooth_velocity);
    memset(env->push, 0, sizeof env->push);
    memset(env->term_sum, 0, sizeof env->term_sum);
    env->reward_sum = env->speed_error_sum = 0;
    robot_sim_load(sim, &env->robot, &env->variation);
    robot_sim_sole_clearance(sim, &env->terrain);
    base_twist(sim, env->base_twist);
    TaskReading reading;
    task_read_imu(sim, &reading);
    task_read_motors(sim, &reading);
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
    env->variation.rigid_friction = 0.8;
    start_episode(env, def, robot, sim, view);
}

/* ---- one policy step ---- */

static void accept_action(TaskEnv *env, const TaskDef *def, const float *action) {
    memmove(env->action[1], env->action[0], 2 * sizeof env->action[0]);
    float limit = (float)def->action_clip;
    for (int i = 0; i < env->shape.actions; i++) {
        float a = action[i];
        env->action[0][i] = !(a > -limit) ? -limit : a > limit ? limit : a;
    }
}

static void push_base(TaskEnv *env, const TaskDef *def) {
    const RandomizeDef *z = &def->randomize;
    for (int i = 0; i < 6; i++) {
        env->push[i] *= 0.95;
    }
    uint32_t interval = (uint32_t)(z->push_interval / TASK_PERIOD + 0.5);
    if (interval == 0 || env->step == 0 || (env->step + env->index * 97u) % interval != 0) {
        return;
    }
    Random r = random_at(env->seed ^ RANDOM_USE_PUSH, env->index, env->tick);
    for (int i = 0; i < 6; i++) {
        double size = i == 2 ? 0 : i < 3 ? z->push_linear : z->push_angular;
        env->push[i] = size * (2 * random_unit(&r) - 1);
        env->robot.qvel[i] += env->push[i];
    }
}

/* A motor at its speed limit gives no torque in the direction of motion. */
static double limit_speed(double torque, double speed, double limit) {
    return limit > 0 && fabs(speed) >= limit && torque * speed > 0 ? 0 : torque;
}

/* tau = clip(strength (Kp (q0 + scale a - q + offset) - Kd qd)). */
static void pd_torque(const TaskEnv *env, const TaskDef *def, const Robot *robot,
                      const RobotSim *sim, const float *action, double *torque) {
    const double *q = robot_sim_qpos(sim) + 7, *qd = robot_sim_qvel(sim) + 6;
    const double *effort = robot_effort(robot), *fastest = robot_speed(robot);
    double pose[ROBOT_JOINTS_MAX], scale = task_action_scale(def, robot);
    task_assist_pose(env, def, robot, pose);
    for (int i = 0; i < env->shape.joints; i++) {
        double target = pose[i] + scale * (double)action[i] + env->motor_offset[i];
        double tau =
            env->kp[i] * env->kp_scale[i] * (target - q[i]) - env->kd[i] * env->kd_scale[i] * qd[i];
        double limit = def->torque_share * effort[i];
        tau *= env->strength[i];
        tau = tau > limit ? limit : tau < -limit ? -limit : tau;
        torque[i] = limit_speed(tau, qd[i], fastest[i]);
    }
}

/* Physics steps of one policy period, with the three latencies. Returns 1 when the simulation
 * diverged. */
static int run_physics(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                       TaskReading *reading, double *torque, const TaskProbe *probe) {
    int steps = (int)(TASK_PERIOD / def->physics_dt + 0.5);
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
        pd_torque(env, def, robot, sim, env->action[k >= env->lag_command ? 0 : 1], torque);
        double wrench[6], *hand = task_assist(env, def, robot, sim, wrench) ? wrench : NULL;
        if (robot_sim_step(sim, torque, hand, &env->terrain, task_env_ground(env))) {
            return 1;
        }
        if (probe) {
            probe->physics_step(probe->context, env, sim, torque);
        }
    }
    return 0;
}

static void feet_motion(TaskEnv *env, const TaskDef *def, const Robot *robot, const RobotSim *sim,
                        TaskMotion *m) {
    double stance_height = 0;
    int stances = 0;
    for (int f = 0; f < env->shape.feet; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        const double *v = foot->sole_center_velocity, *force = foot->force;
        m->foot_height[f] = foot->sole_height;
        m->foot_speed[f] = sqrt(v[0] * v[0] + v[1] * v[1]);
        m->foot_force[f] = sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
        m->contact[f] = force[2] > CONTACT_FORCE;
        m->stance[f] = task_gait_stance(robot, env->phase, m->standing, f);
        m->either[f] = task_gait_either(def, robot, env->phase, m->standing, f);
        m->wanted_height[f] = task_gait_height(def, robot, env->phase, m->standing, f);
        if (m->contact[f]) {
            m->landed_air_time += fmin(env->air_time[f], 0.5 * def->gait_period);
            env->air_time[f] = 0;
        } else {
            env->air_time[f] += TASK_PERIOD;
        }
        if (m->stance[f]) {
            stance_height += foot->sole_center[2];
            stances++;
        }
    }
    m->base_height = robot_sim_qpos(sim)[2] - stance_height / (stances ? stances : 1);
}

TaskMotion task_describe_motion(TaskEnv *env, const TaskDef *def, const Robot *robot,
                                const RobotSim *sim, const double *torque) {
    TaskMotion m = {.def = def, .robot = robot, .env = env};
    const double *rotation = robot_sim_base_rotation(sim), *qvel = robot_sim_qvel(sim);
    double heading = atan2(rotation[3], rotation[0]), c = cos(heading), s = sin(heading), twist[6],
           change = 0;
    m.standing = task_is_standing(env->command);
    m.velocity[0] = c * qvel[0] + s * qvel[1];
    m.velocity[1] = -s * qvel[0] + c * qvel[1];
    m.velocity[2] = qvel[2];
    base_twist(sim, twist);
    for (int i = 0; i < 3; i++) {
        m.omega[i] = qvel[3 + i];
        m.gravity[i] = -rotation[6 + i];
    }
    for (int i = 0; i < 6; i++) {
        change += (twist[i] - env->base_twist[i]) * (twist[i] - env->base_twist[i]);
    }
    m.twist_change = sqrt(change);
    const double now[3] = {m.velocity[0], m.velocity[1], m.omega[2]};
    for (int i = 0; i < 3; i++) {
        env->smooth_velocity[i] +=
            TASK_PERIOD / def->reward.tracking_time * (now[i] - env->smooth_velocity[i]);
    }
    memcpy(env->base_twist, twist, sizeof twist);
    memcpy(m.q, robot_sim_qpos(sim) + 7, sizeof m.q);
    memcpy(m.qd, qvel + 6, sizeof m.qd);
    memcpy(m.qd_before, env->joint_speed, sizeof m.qd_before);
    memcpy(env->joint_speed, m.qd, sizeof m.qd);
    memcpy(m.torque, torque, (size_t)env->shape.joints * sizeof *torque);
    m.foot_distance = robot_sim_foot_distance(sim);
    m.knee_distance = robot_sim_knee_distance(sim);
    feet_motion(env, def, robot, sim, &m);
    return m;
}

/* Bool: the base tilts too much, a shell touches the ground, or a foot has passed through the other
 * leg, because the engine computes no contact between the legs. */
static int has_fallen(const TaskEnv *env, const TaskDef *def, const RobotSim *sim) {
    return robot_sim_foot_distance(sim) < def->crossing_limit ||
           robot_sim_base_rotation(sim)[8] < cos(def->tilt_limit) ||
           robot_sim_body_clearance(sim, &env->terrain) < 0;
}

static void advance_clock(TaskEnv *env, const TaskDef *def) {
    env->tick++;
    env->step++;
    memcpy(env->command_seen, env->command, sizeof env->command);
    env->phase += TASK_PERIOD / def->gait_period;
    env->phase -= floor(env->phase);
    uint32_t interval = (uint32_t)(def->command_interval / TASK_PERIOD + 0.5);
    if (!env->command_frozen && interval && env->step % interval == 0) {
        task_draw_command(env, def);
    }
}

static void report_episode(const TaskEnv *env, TaskStep *out) {
    out->length = env->step - env->step_first;
    out->episode_reward = (float)env->reward_sum;
    out->episode_speed_error = (float)(env->speed_error_sum / (out->length ? out->length : 1));
    for (int i = 0; i < TASK_REWARD_COUNT; i++) {
        out->episode_terms[i] = (float)env->term_sum[i];
    }
}

/* Computes the reward of the step just made. Returns 0 when it is not finite. */
static int take_reward(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                       const double *torque, float *reward) {
    double terms[TASK_REWARD_COUNT];
    robot_sim_store(sim, &env->robot);
    TaskMotion motion = task_describe_motion(env, def, robot, sim, torque);
    *reward = (float)task_reward(&motion, terms);
    if (!isfinite(*reward)) {
        return 0;
    }
    env->speed_error_sum +=
        hypot(env->smooth_velocity[0] - env->command[0], env->smooth_velocity[1] - env->command[1]);
    env->reward_sum += (double)*reward;
    for (int i = 0; i < TASK_REWARD_COUNT; i++) {
        env->term_sum[i] += terms[i] * TASK_PERIOD;
    }
    return 1;
}

TaskStep task_env_step(TaskEnv *env, const TaskDef *def, const Robot *robot, RobotSim *sim,
                       const float *action, int auto_reset, const TaskView *view,
                       const TaskProbe *probe) {
    TaskStep out = {.valid = 1};
    TaskReading reading;
    double torque[ROBOT_JOINTS_MAX];
    accept_action(env, def, action);
    push_base(env, def);
    lend_map(env, def);
    robot_sim_set_solver(sim, def->newton ? MILD_SOLVER_NEWTON : MILD_SOLVER_GAUSS_SEIDEL,
                         def->contact_tolerance, def->contact_iterations);
    robot_sim_load(sim, &env->robot, &env->variation);
    int bad = run_physics(env, def, robot, sim, &reading, torque, probe) ||
              !take_reward(env, def, robot, sim, torque, &out.reward);
    if (bad) {
        out.reward = 0;
        out.valid = 0;
    }
    advance_clock(env, def);
    int fallen = bad || has_fallen(env, def, sim);
    out.timeout = !fallen && env->step >= env->step_limit;
    out.done = fallen || out.timeout;
    task_assist_adapt(env, fallen);
    if (out.done) {
        report_episode(env, &out);
    }
    if (out.done && auto_reset) {
        task_env_reset(env, def, robot, sim, view);
    } else if (!bad) {
        task_observe(env, def, robot, sim, &reading, 0, view);
    }
    return_map(env);
    return out;
}
