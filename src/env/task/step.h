/* The policy step but for its physics, read top to bottom: what MuJoCo (task.h) and the batch
 * engine (env/batch_step.h) have in common. */
#ifndef TASK_STEP_H
#define TASK_STEP_H

#include <math.h>
#include <string.h>

#include "base/random.h"
#include "env/task/driven.h"
#include "env/task/observe.h"
#include "env/task/randomize.h"
#include "env/task/reward.h"
#include "env/task/scan.h"

#define TASK_RANDOM_START 0x53544152u
#define TASK_RANDOM_PUSH 0x50555348u
#define TASK_RANDOM_DROP 0x44524f50u
#define TASK_DROP 0.1          /* [m] greatest height of a drop */
#define TASK_DROP_LEAN 0.3     /* [rad] greatest lean from the back or the side */
#define TASK_CONTACT_FORCE 5.0 /* [N] */

/* ---- the block of an environment ---- */

MILD_HD_FN size_t task_whole_lines(size_t bytes) {
    return (bytes + 63) / 64 * 64;
}

/* Frames of the ring: as many as the means of the history reach back. */
MILD_HD_FN uint32_t task_frames_held(const TaskDef *def) {
    return (uint32_t)((TASK_FRAMES - 1) * def->history_stride);
}

/* Of a TaskEnv, its frames, which follow it, and the poses of its scans. */
MILD_HD_FN size_t task_env_head_bytes(const TaskShape *shape, uint32_t held) {
    const size_t frames = held * (size_t)shape->observation * sizeof(TaskFrame);
    return task_whole_lines(sizeof(TaskEnv) +
                            (shape->scan > 0
                                 ? task_scan_place(frames) + TASK_SCAN_POSES * sizeof(TaskScanPose)
                                 : frames));
}

/* A new environment. */
MILD_HD_FN void task_env_init_head(TaskEnv *env, const TaskDef *def, TaskShape shape, uint64_t seed,
                                   uint32_t index) {
    const uint32_t held = task_frames_held(def);
    memset(env, 0, task_env_head_bytes(&shape, held));
    env->shape = shape;
    env->held = held;
    env->seed = seed;
    env->index = index;
    env->step_limit = (uint32_t)(def->episode / TASK_PERIOD + 0.5);
    env->assist_level = 1;
    env->command_most = def->jump[1] > 0 ? def->jump_start : def->vx_start;
}

/* What an environment keeps, and back, before a new episode. */
MILD_HD_FN TaskProgress task_progress(const TaskEnv *env) {
    const TaskProgress progress = {env->assist_level, env->command_most, env->tick};
    return progress;
}

MILD_HD_FN void task_set_progress(TaskEnv *env, TaskProgress progress) {
    env->assist_level = progress.assist_level;
    env->command_most = progress.command_most;
    env->tick = env->tick_first = (uint32_t)progress.tick;
}

/* Bool: the shells stand in this episode. */
MILD_HD_FN int task_shells_stand(const TaskEnv *env, const RobotTable *robot) {
    return robot->shells_stand && env->variation.shells_stand;
}

/* ---- start of an episode ---- */

/* Quaternion (w x y z) of a turn by `yaw` about z, after one by `pitch` about y, after one by
 * `roll` about x. */
MILD_HD_FN void task_turn(double yaw, double pitch, double roll, Real *quaternion) {
    const double cy = task_cos(0.5 * yaw), sy = task_sin(0.5 * yaw);
    const double cp = task_cos(0.5 * pitch), sp = task_sin(0.5 * pitch);
    const double cr = task_cos(0.5 * roll), sr = task_sin(0.5 * roll);
    quaternion[0] = (Real)(cy * cp * cr + sy * sp * sr);
    quaternion[1] = (Real)(cy * cp * sr - sy * sp * cr);
    quaternion[2] = (Real)(cy * sp * cr + sy * cp * sr);
    quaternion[3] = (Real)(sy * cp * cr - cy * sp * sr);
}

/* Lies on its back, on a side, or (Shoemake 1992) in any attitude. */
MILD_HD_FN void task_draw_attitude(TaskEnv *env, const TaskDef *def, Random *r) {
    Real *q = env->robot.qpos + 3;
    if (def->start == TASK_START_ANY) {
        const double u = random_unit(r), a = TASK_TWO_PI * random_unit(r);
        const double b = TASK_TWO_PI * random_unit(r);
        const double low = task_sqrt(1 - u), high = task_sqrt(u);
        q[0] = (Real)(high * task_cos(b));
        q[1] = (Real)(low * task_sin(a));
        q[2] = (Real)(low * task_cos(a));
        q[3] = (Real)(high * task_sin(b));
        return;
    }
    const double turn = random_unit(r) < 0.5 ? -1 : 1;
    const double roll = def->start == TASK_START_BACK ? TASK_PI : 0.5 * TASK_PI * turn;
    const double yaw = TASK_PI * (2 * random_unit(r) - 1);
    const double pitch = task_spread(r, TASK_DROP_LEAN);
    task_turn(yaw, pitch, roll + task_spread(r, TASK_DROP_LEAN), q);
}

/* Whether the episode begins lying, and how: attitude and joints, and in the place of the height of
 * the base that of a robot whose lowest point is above the ground by the height of the drop.
 * place of env.c and env_pose put it there. */
MILD_HD_FN void task_draw_drop(TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                               double height) {
    Random r = random_at(env->seed ^ TASK_RANDOM_DROP, env->index, env->tick);
    env->dropped = random_unit(&r) < def->start_share && task_shells_stand(env, robot) &&
                   def->start != TASK_START_STAND;
    if (!env->dropped) {
        return;
    }
    task_draw_attitude(env, def, &r);
    env->robot.qpos[2] = (Real)(height + robot->stand_height + TASK_DROP * random_unit(&r));
    for (int i = tile_lane(); i < env->shape.joints; i += TILE) {
        Random own = random_after(r, i);
        env->robot.qpos[7 + i] =
            (Real)random_uniform(&own, robot->joint_low[i], robot->joint_high[i]);
    }
}

/* Bool: the start of a drop, in which the motors only damp. */
MILD_HD_FN int task_is_limp(const TaskEnv *env, const TaskDef *def) {
    return env->dropped && (env->step - env->step_first) * TASK_PERIOD < def->settle;
}

MILD_HD_FN void task_draw_start(TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                                double height, double depth) {
    const RandomizeDef *z = &def->randomize;
    Random r = random_at(env->seed ^ TASK_RANDOM_START, env->index, env->tick);
    const double *pose = robot->default_pose;
    double yaw = env->command_frozen ? 0 : TASK_PI * (2 * random_unit(&r) - 1);
    env->robot.qpos[2] = height + robot->stand_height - depth + 0.002;
    env->robot.qpos[3] = task_cos(0.5 * yaw);
    env->robot.qpos[6] = task_sin(0.5 * yaw);
    for (int i = tile_lane(); i < env->shape.joints; i += TILE) {
        Random own = random_after(r, i);
        double q = pose[i] + z->initial_joint * (2 * random_unit(&own) - 1);
        env->robot.qpos[7 + i] = fmin(fmax(q, robot->joint_low[i]), robot->joint_high[i]);
    }
    r = random_after(r, env->shape.joints);
    for (int i = tile_lane(); i < 6; i += TILE) {
        Random own = random_after(r, i);
        env->robot.qvel[i] = z->initial_velocity * (2 * random_unit(&own) - 1);
    }
    r = random_after(r, 6);
    env->phase = random_unit(&r) < 0.5 || def->jump[1] > 0 ? 0 : 0.5;
    /* The first episodes end at different times, so that the environments do not reset in
     * lockstep. */
    env->step = env->tick == env->tick_first && !env->command_frozen
                    ? (uint32_t)(random_unit(&r) * 0.9 * env->step_limit)
                    : 0;
    env->step_first = env->step;
    tile_sync();
    task_start_driven(env, def, robot);
    task_draw_drop(env, def, robot, height);
}

MILD_HD_FN void task_see_command(TaskEnv *env) {
    for (int i = 0; i < TASK_COMMANDS; i++) {
        env->command_seen[i] = env->command[i];
    }
}

/* What an episode knows of the one before, and its command. */
MILD_HD_FN void task_clear_episode(TaskEnv *env, const TaskDef *def) {
    tile_clear(&env->robot, sizeof env->robot);
    tile_clear(env->action, sizeof env->action);
    tile_clear(env->air_time, sizeof env->air_time);
    tile_clear(env->joint_speed, sizeof env->joint_speed);
    tile_clear(env->smooth_velocity, sizeof env->smooth_velocity);
    tile_clear(env->push, sizeof env->push);
    tile_clear(env->risen, sizeof env->risen);
    tile_clear(env->term_sum, sizeof env->term_sum);
    env->reward_sum = env->speed_error_sum = 0;
    if (tile_lane() == 0 && !env->command_frozen) {
        task_draw_command(env, def);
    }
    tile_sync();
    task_see_command(env);
}

/* An episode on what has been drawn (randomize.h). height: [m] of the ground; depth: [m] how deep
 * the feet stand in it, so that episodes start neither in the air nor buried. */
MILD_HD_FN void task_begin_episode(TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                                   double height, double depth) {
    task_clear_episode(env, def);
    tile_sync();
    task_draw_start(env, def, robot, height, depth);
    tile_sync();
}

/* What the sensors say in the first pose of an episode. */
MILD_HD_FN void task_first_sensors(TaskEnv *env, const RobotReading *reading,
                                   TaskSensors *sensors) {
    for (int i = 0; i < 6; i++) {
        env->base_twist[i] = env->robot.qvel[i];
    }
    task_read_imu(reading->rotation, env->robot.qvel, sensors);
    task_read_motors(env->robot.qpos + 7, env->robot.qvel + 6, sensors);
}

/* ---- before the physics ---- */

MILD_HD_FN void task_accept_action(TaskEnv *env, const TaskDef *def, const float *action) {
    float limit = (float)def->action_clip;
    for (int i = tile_lane(); i < env->shape.actions; i += TILE) {
        float a = action[i];
        env->action[2][i] = env->action[1][i];
        env->action[1][i] = env->action[0][i];
        env->action[0][i] = !(a > -limit) ? -limit : a > limit ? limit : a;
    }
}

MILD_HD_FN void task_push_base(TaskEnv *env, const TaskDef *def) {
    const RandomizeDef *z = &def->randomize;
    for (int i = tile_lane(); i < 6; i += TILE) {
        env->push[i] *= 0.95;
    }
    uint32_t interval = (uint32_t)(z->push_interval / TASK_PERIOD + 0.5);
    if (interval == 0 || env->step == 0 || (env->step + env->index * 97u) % interval != 0) {
        return;
    }
    Random r = random_at(env->seed ^ TASK_RANDOM_PUSH, env->index, env->tick);
    for (int i = tile_lane(); i < 6; i += TILE) {
        Random own = random_after(r, i);
        double size = i == 2 ? 0 : i < 3 ? z->push_linear : z->push_angular;
        env->push[i] = size * (2 * random_unit(&own) - 1);
        env->robot.qvel[i] += env->push[i];
    }
}

/* What comes before the physics steps of a policy step. */
MILD_HD_FN void task_begin_step(TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                                const float *action) {
    task_accept_action(env, def, action);
    task_move_driven(env, def, robot);
    task_push_base(env, def);
}

/* ---- motors ---- */

/* The motor of joint i during a policy step. */
MILD_HD_FN TaskMotor task_motor(const TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                                const TaskGains *gains, int i) {
    TaskMotor motor;
    double rest = task_assist_pose(env, def, robot, i), scale = task_action_scale(def, robot);
    for (int late = 0; late < 2; late++) {
        motor.target[late] = rest + scale * (double)env->action[late][i] + env->motor_offset[i];
    }
    motor.kp = task_is_limp(env, def) ? 0 : env->strength * REAL(gains->kp[i]) * env->kp_scale[i];
    motor.kd = env->strength * REAL(gains->kd[i]) * env->kd_scale[i];
    motor.limit = gains->limit[i];
    motor.fastest = robot->speed[i];
    motor.full = robot->full_speed[i];
    return motor;
}

/* [N m] Greatest torque in the direction of motion: a motor's voltage bounds it from the speed
 * `full` on. */
MILD_HD_FN double task_torque_most(const TaskMotor *motor, double qd) {
    const double speed = fabs(qd), end = motor->fastest;
    const double full = motor->full > 0 ? motor->full : end;
    if (end == 0 || speed < full) {
        return motor->limit;
    }
    return speed < end ? motor->limit * (end - speed) / (end - full) : 0;
}

/* [N m] Torque at angle q and speed qd. late: bool, the last action still counts.
 *
 * tau = clip(strength (Kp (q0 + scale a - q + offset) - Kd qd)) */
MILD_HD_FN double task_torque(const TaskMotor *motor, int late, double q, double qd) {
    double tau = motor->kp * (motor->target[late] - q) - motor->kd * qd;
    const double most = tau * qd > 0 ? task_torque_most(motor, qd) : motor->limit;
    return tau > most ? most : tau < -most ? -most : tau;
}

/* Bool: physics step k of `steps` computes torques anew; else those of the step before go on, which
 * env->torque has kept.
 *
 * With torque_hold the torque is computed when the action arrives, after lag_command steps, and
 * held for a whole policy period. A new episode has none to hold. */
MILD_HD_FN int task_motors_act(const TaskEnv *env, const TaskDef *def, int k, int steps) {
    const int begins = k == 0 && env->step == env->step_first;
    return !def->torque_hold || begins || k == env->lag_command % steps;
}

/* ---- after the physics ---- */

MILD_HD_FN void task_feet_motion(TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                                 const RobotReading *reading, TaskMotion *m) {
    const double swing_time =
        (1 - task_gait_share(def, env->command_seen)) * task_gait_period(def, env->command_seen);
    Real stance_height = 0;
    int stances = 0;
    for (int f = 0; f < env->shape.feet; f++) {
        const Real *v = reading->foot[f].sole_center_velocity, *force = reading->foot[f].force;
        m->foot_height[f] = reading->foot[f].sole_height;
        m->foot_speed[f] = task_sqrt(v[0] * v[0] + v[1] * v[1]);
        m->foot_force[f] =
            task_sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2]);
        m->contact[f] = force[2] > TASK_CONTACT_FORCE;
        m->wanted[f] = task_gait_foot(def, robot, env->phase, env->command, f);
        if (m->contact[f]) {
            m->landed_air_time += fmin((double)env->air_time[f], swing_time);
        }
        if (m->wanted[f].stance) {
            stance_height += reading->foot[f].sole_center[2];
            stances++;
        }
    }
    m->base_height = stances ? env->robot.qpos[2] - stance_height / (Real)stances : reading->above;
    m->rise = reading->above - REAL(task_nominal_height(def, robot));
    tile_sync();
    for (int f = tile_lane(); f < env->shape.feet; f += TILE) {
        env->air_time[f] = m->contact[f] ? 0 : env->air_time[f] + REAL(TASK_PERIOD);
    }
}

/* Describes the policy step just made. env still has the base twist, joint speeds, smoothed
 * velocity and air times of the previous step, which are updated. torque: [joints] of the last
 * physics step. */
MILD_HD_FN TaskMotion task_describe_motion(TaskEnv *env, const TaskDef *def,
                                           const RobotTable *robot, const RobotReading *reading,
                                           const Real *torque) {
    TaskMotion m;
    memset(&m, 0, sizeof m);
    m.def = def, m.robot = robot, m.env = env;
    const Real *rotation = reading->rotation, *qvel = env->robot.qvel;
    Real length = task_sqrt(rotation[0] * rotation[0] + rotation[3] * rotation[3]);
    Real c = length > 0 ? rotation[0] / length : 1, s = length > 0 ? rotation[3] / length : 0;
    Real twist[6], change = 0;
    m.standing = task_is_standing(def, env->command);
    m.velocity[0] = c * qvel[0] + s * qvel[1];
    m.velocity[1] = -s * qvel[0] + c * qvel[1];
    m.velocity[2] = qvel[2];
    for (int i = 0; i < 3; i++) {
        m.omega[i] = qvel[3 + i];
        m.gravity[i] = -rotation[6 + i];
    }
    const int parts = def->reward.acceleration_form == TASK_ACCELERATION_LINEAR ? 3 : 6;
    for (int i = 0; i < 6; i++) {
        twist[i] = qvel[i];
    }
    for (int i = 0; i < parts; i++) {
        change += (twist[i] - env->base_twist[i]) * (twist[i] - env->base_twist[i]);
    }
    m.twist_change = task_sqrt(change);
    tile_sync();
    for (int i = tile_lane(); i < 3; i += TILE) {
        const Real now = i < 2 ? m.velocity[i] : m.omega[2];
        env->smooth_velocity[i] +=
            REAL(TASK_PERIOD) / REAL(def->reward.tracking_time) * (now - env->smooth_velocity[i]);
    }
    for (int i = tile_lane(); i < 6; i += TILE) {
        env->base_twist[i] = twist[i];
    }
    const Real *q = env->robot.qpos + 7;
    for (int i = tile_lane(); i < env->shape.joints; i += TILE) {
        m.q[i] = q[i];
        m.qd[i] = qvel[6 + i];
        m.qd_before[i] = env->joint_speed[i];
        env->joint_speed[i] = m.qd[i];
        m.torque[i] = torque[i];
    }
    m.foot_distance = reading->foot_distance;
    m.knee_distance = reading->knee_distance;
    task_feet_motion(env, def, robot, reading, &m);
    tile_sync();
    return m;
}

/* Bool: a joint was pushed out of its range. */
MILD_HD_FN int task_joint_is_broken(const TaskEnv *env, const RobotTable *robot) {
    int broken = 0;
    for (int i = 0; i < env->shape.joints; i++) {
        const double q = env->robot.qpos[7 + i];
        broken |= q < robot->joint_low[i] - TASK_JOINT_BROKEN ||
                  q > robot->joint_high[i] + TASK_JOINT_BROKEN;
    }
    return broken;
}

/* Why the episode ends with this pose; TASK_END_time where nothing but the time can end it. The
 * contact of the legs does not keep a foot from passing before the other to its far side. */
MILD_HD_FN TaskEnd task_end_cause(const TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                                  const RobotReading *reading) {
    const int stand = task_shells_stand(env, robot);
    const int lies = stand && def->may_lie;
    if (!lies && reading->rotation[8] < task_cos(def->tilt_limit)) {
        return TASK_END_tilt;
    }
    if (!lies && reading->base_clearance < 0) {
        return TASK_END_base;
    }
    if (env->variation.rigid && !stand && reading->body_clearance < 0) {
        return TASK_END_shell;
    }
    if (def->crossing_limit > -1 && reading->foot_distance < def->crossing_limit) {
        return TASK_END_crossing;
    }
    return task_joint_is_broken(env, robot) ? TASK_END_joint : TASK_END_time;
}

/* One policy step on the clocks of the episode: the phase, the command that the policy sees and, if
 * the caller does not set it, a new command. */
MILD_HD_FN void task_advance_clock(TaskEnv *env, const TaskDef *def) {
    env->tick++;
    env->step++;
    env->phase += TASK_PERIOD / task_gait_period(def, env->command_seen);
    if (env->phase >= 1) {
        env->risen[1] = env->risen[0];
        env->risen[0] = 0;
    }
    env->phase -= floor(env->phase);
    if (def->jump[1] > 0 && task_is_standing(def, env->command_seen)) {
        env->phase = 0; /* a jump begins with its stance */
    }
    task_see_command(env);
    uint32_t interval = (uint32_t)(def->command_interval / TASK_PERIOD + 0.5);
    if (!env->command_frozen && interval && env->step % interval == 0) {
        if (env->step - env->step_first >= interval) { /* it had the whole time to follow */
            task_command_adapt(env, def);
        }
        task_draw_command(env, def);
    }
}

MILD_HD_FN void task_report_episode(const TaskEnv *env, TaskStep *out) {
    out->length = env->step - env->step_first;
    out->episode_reward = (float)env->reward_sum;
    out->episode_speed_error =
        (float)(env->speed_error_sum / (out->length ? (Real)out->length : 1));
    for (int i = 0; i < TASK_REWARD_COUNT; i++) {
        out->episode_terms[i] = (float)env->term_sum[i];
    }
}

/* Computes the reward of the step just made. Returns 0 when it is not finite. */
MILD_HD_FN int task_take_reward(TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                                const RobotReading *reading, const Real *torque, float *reward) {
    Real terms[TASK_REWARD_COUNT];
    TaskMotion motion = task_describe_motion(env, def, robot, reading, torque);
    *reward = (float)task_reward(&motion, terms);
    if (!isfinite(*reward)) {
        return 0;
    }
    if (tile_lane() == 0) {
        env->speed_error_sum += hypot(env->smooth_velocity[0] - env->command[0],
                                      env->smooth_velocity[1] - env->command[1]);
        env->reward_sum += (Real)*reward;
        env->risen[0] = motion.rise > env->risen[0] ? motion.rise : env->risen[0];
    }
    for (int i = tile_lane(); i < TASK_REWARD_COUNT; i += TILE) {
        env->term_sum[i] += terms[i] * REAL(TASK_PERIOD);
    }
    return 1;
}

/* What comes after the physics steps. torque: [joints] of the last one. diverged: bool, they broke
 * off, and the reading is of no use. */
MILD_HD_FN TaskStep task_end_step(TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                                  const RobotReading *reading, const Real *torque, int diverged) {
    TaskStep out;
    memset(&out, 0, sizeof out);
    int bad = diverged || !task_take_reward(env, def, robot, reading, torque, &out.reward);
    if (bad) {
        out.reward = 0;
    }
    out.valid = !bad;
    const TaskEnd cause = bad ? TASK_END_not_finite : task_end_cause(env, def, robot, reading);
    const int fallen = cause != TASK_END_time;
    tile_sync();
    if (tile_lane() == 0) {
        task_advance_clock(env, def);
        task_assist_adapt(env, def, fallen);
    }
    tile_sync();
    out.timeout = !fallen && env->step >= env->step_limit;
    out.done = fallen || out.timeout;
    out.cause = (uint8_t)cause;
    if (out.done) {
        task_report_episode(env, &out);
    }
    return out;
}

#endif
