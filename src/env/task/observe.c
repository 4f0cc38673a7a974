/* Observations (docs/task.md section 5). One frame:
 *   0..2   base angular velocity, base frame [rad/s]
 *   3..5   command (vx, vy, wz) times (2, 2, 1)
 *   6..8   unit gravity in the base frame
 *   then for each of n joints, in the order of robot.ini,
 *   9..         q - q_default [rad]
 *   9 + n..     qd times 0.05
 *   9 + 2 n..   last action
 *   9 + 3 n, +1 sin, cos of the gait clock; (0, 0) when standing: unlike the vendor's (0, 1) it is
 *               its own mirror image */
#include <math.h>
#include <string.h>

#include "base/random.h"
#include "env/task/task.h"

#define TWO_PI 6.283185307179586
#define RANDOM_USE_NOISE 0x4e4f4953u

TASK_FN void task_read_imu(const RobotSim *sim, TaskReading *reading) {
    const TaskReal *rotation = robot_sim_base_rotation(sim), *qvel = robot_sim_qvel(sim);
    for (int i = 0; i < 3; i++) {
        reading->omega[i] = qvel[3 + i];
        reading->gravity[i] = -rotation[6 + i];
    }
}

TASK_FN void task_read_motors(const RobotSim *sim, TaskReading *reading) {
    for (int i = 0; i < TASK_JOINTS; i++) {
        reading->q[i] = robot_sim_qpos(sim)[7 + i];
        reading->qd[i] = robot_sim_qvel(sim)[6 + i];
    }
}

/* A frame without noise. joint, speed: [joints]. */
MILD_HD_FN void make_frame(const TaskEnv *env, const TaskDef *def, const double *pose,
                           const TaskReal *omega, const TaskReal *gravity, const TaskReal *joint,
                           const TaskReal *speed, float *frame) {
    int joints = env->shape.joints;
    for (int i = task_lane(); i < 3; i += TASK_LANES) {
        frame[i] = (float)omega[i];
        frame[3 + i] = (float)(env->command_seen[i] * (i < 2 ? 2 : 1));
        frame[6 + i] = (float)gravity[i];
    }
    float *q = frame + 9, *qd = q + joints, *action = qd + joints, *clock = action + joints;
    for (int i = task_lane(); i < joints; i += TASK_LANES) {
        q[i] = (float)(joint[i] - pose[i]);
        qd[i] = (float)(0.05 * speed[i]);
        action[i] = env->action[0][i];
    }
    if (task_lane() == 0) {
        int still = !def->clock || task_is_standing(def, env->command_seen);
        clock[0] = still ? 0 : (float)task_sin(TWO_PI * env->phase);
        clock[1] = still ? 0 : (float)task_cos(TWO_PI * env->phase);
    }
}

/* Two of the numbers of this policy step, uniform in [-1, 1). */
MILD_HD_FN void draw_noise(const TaskEnv *env, int pair, double noise[2]) {
    Random r = random_at(env->seed ^ RANDOM_USE_NOISE, env->index, env->tick);
    r.use = (uint32_t)(2 * pair);
    noise[0] = 2 * random_unit(&r) - 1;
    noise[1] = 2 * random_unit(&r) - 1;
}

MILD_HD_FN void add_noise(const TaskEnv *env, const TaskDef *def, float *frame) {
    float *q = frame + 9, *qd = q + env->shape.joints;
    for (int pair = task_lane(); pair < 3 + env->shape.joints; pair += TASK_LANES) {
        double noise[2];
        draw_noise(env, pair, noise);
        if (pair < 3) {
            frame[pair] += (float)(def->noise_omega * noise[0]);
            frame[6 + pair] += (float)(def->noise_gravity * noise[1]);
        } else {
            q[pair - 3] += (float)(def->noise_q * noise[0]);
            qd[pair - 3] += (float)(def->noise_qd * noise[1]);
        }
    }
}

/* Rotates a world vector into the base frame. */
MILD_HD_FN void to_base(const TaskReal *rotation, const TaskReal *v, float *out) {
    for (int i = 0; i < 3; i++) {
        out[i] = (float)(rotation[i] * v[0] + rotation[3 + i] * v[1] + rotation[6 + i] * v[2]);
    }
}

/* Velocity of the base, then velocities and heights of the feet. */
MILD_HD_FN void write_estimates(const TaskEnv *env, const TaskDef *def, const RobotSim *sim,
                                float *estimate) {
    const TaskReal *rotation = robot_sim_base_rotation(sim);
    int feet = env->shape.feet;
    for (int n = task_lane(); n <= feet; n += TASK_LANES) {
        const RobotFoot *foot = robot_sim_foot(sim, n > 0 ? n - 1 : 0);
        float *velocity = estimate + 3 * n;
        to_base(rotation, n > 0 ? foot->sole_center_velocity : robot_sim_qvel(sim), velocity);
        if (n > 0) {
            estimate[2 + 3 * feet + n] = (float)(def->height_scale * foot->sole_height);
            continue;
        }
        for (int i = 0; i < 3; i++) {
            velocity[i] *= (float)def->velocity_scale;
        }
    }
}

/* Six numbers of each foot. */
MILD_HD_FN void write_feet(const TaskEnv *env, const TaskDef *def, const Robot *robot,
                           const RobotSim *sim, float *out) {
    int standing = task_is_standing(def, env->command);
    const float force_scale = (float)(0.6 * robot_foot_force(robot)); /* [N] */
    for (int f = task_lane(); f < env->shape.feet; f += TASK_LANES) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        float *own = out + 6 * f;
        to_base(robot_sim_base_rotation(sim), foot->force, own);
        for (int i = 0; i < 3; i++) {
            float scaled = own[i] / force_scale;
            own[i] = scaled > 5 ? 5 : scaled < -5 ? -5 : scaled;
        }
        own[3] = foot->force[2] > 5;
        own[4] = (float)task_gait_stance(robot, env->phase, standing, f);
        own[5] = (float)(10 * foot->result.depth_mean);
    }
}

/* What was drawn for the episode. */
MILD_HD_FN void write_episode(const TaskEnv *env, const TaskDef *def, const Robot *robot,
                              const RobotSim *sim, float *out) {
    float buffer[TASK_GROUND_NUMBERS];
    const float *ground = task_ground_under(env, def, robot, sim, buffer);
    const RobotVariation *variation = &env->variation;
    float *const rest = out + 10 + TASK_GROUND_NUMBERS;
    for (int i = task_lane(); i < 6; i += TASK_LANES) {
        out[i] = (float)env->push[i];
    }
    for (int i = task_lane(); i < 3; i += TASK_LANES) {
        out[7 + i] = (float)(variation->com_offset[i] * 100);
        rest[9 + i] = (float)env->smooth_velocity[i];
    }
    for (int i = task_lane(); i < TASK_GROUND_NUMBERS; i += TASK_LANES) {
        out[10 + i] = variation->rigid ? 0 : ground[i];
    }
    if (task_lane() == 0) {
        const double step = def->physics_dt / TASK_PERIOD;
        out[6] = (float)(variation->base_mass_add / 4);
        rest[0] = (float)variation->rigid;
        rest[1] = (float)task_height_above(sim, &env->terrain);
        rest[2] = (float)env->strength[0];
        rest[3] = (float)variation->armature_scale;
        rest[4] = (float)(env->lag_command * step);
        rest[5] = (float)(env->lag_motor * step);
        rest[6] = (float)(env->lag_imu * step);
        rest[7] = (float)variation->rigid_friction;
        rest[8] = (float)task_assist_share(env, def);
    }
}

MILD_HD_FN void copy_row(const float *from, int width, float *to) {
    for (int j = task_lane(); j < width; j += TASK_LANES) {
        to[j] = from[j];
    }
}

/* Five means of older frames before the frame, which then takes the place of the oldest in the
 * ring. At the start of an episode the first frame also fills the older ones. */
MILD_HD_FN void write_history(TaskEnv *env, const TaskDef *def, int first, float *history) {
    const int width = env->shape.observation, stride = def->history_stride;
    const uint32_t held = env->held;
    const float *frame = history + (TASK_FRAMES - 1) * width;
    for (int j = task_lane(); j < width; j += TASK_LANES) {
        TaskFrame *column = task_env_frames(env) + j;
        uint32_t place = env->oldest;
        for (uint32_t k = 0; first && k < held; k++) {
            column[k * (uint32_t)width] = frame_pack(frame[j]);
        }
        for (int i = 0; i < TASK_FRAMES - 1; i++) {
            float sum = 0;
            TASK_UNROLL
            for (int k = 0; k < stride; k++) {
                sum += frame_unpack(column[place * (uint32_t)width]);
                place = place + 1 < held ? place + 1 : 0;
            }
            history[i * width + j] = sum / (float)stride;
        }
        column[place * (uint32_t)width] = frame_pack(frame[j]);
    }
}

TASK_FN void task_observe(TaskEnv *env, const TaskDef *def, const Robot *robot, const RobotSim *sim,
                          const TaskReading *reading, int first, const TaskView *view) {
    const double *pose = robot_default_pose(robot);
    const int width = env->shape.observation;
    float *history = TASK_HAS_HISTORY ? task_env_history(env) : view->history;
    float *frame = history + (TASK_FRAMES - 1) * width;
    make_frame(env, def, pose, reading->omega, reading->gravity, reading->q, reading->qd, frame);
    task_lanes_sync();
    if (def->observe_noise) {
        add_noise(env, def, frame);
        task_lanes_sync();
    }
    write_history(env, def, first, history);
    task_lanes_sync();
    if (task_lane() == 0) {
        env->oldest = (env->oldest + 1) % env->held;
    }
    if (view->history && view->history != history) {
        copy_row(history, env->shape.history, view->history);
    }
    if (view->frame) {
        copy_row(frame, width, view->frame);
    }
    if (view->estimate) {
        write_estimates(env, def, sim, view->estimate);
    }
    if (view->critic) {
        const TaskReal *qpos = robot_sim_qpos(sim), *qvel = robot_sim_qvel(sim);
        const TaskReal *rotation = robot_sim_base_rotation(sim);
        const TaskReal gravity[3] = {-rotation[6], -rotation[7], -rotation[8]};
        make_frame(env, def, pose, qvel + 3, gravity, qpos + 7, qvel + 6, view->critic);
        float *rest = view->critic + width;
        write_estimates(env, def, sim, rest);
        write_feet(env, def, robot, sim, rest + env->shape.estimates);
        write_episode(env, def, robot, sim, rest + env->shape.estimates + 6 * env->shape.feet);
    }
}
