/* Observations (docs/policy.md section 3). One frame:
 *   0..2   base angular velocity, base frame [rad/s]
 *   3..5   command (vx, vy, wz) times (2, 2, 1)
 *   6..8   unit gravity in the base frame
 *   then for each of n joints, in the order of robot.ini, of which a policy acts on the first m,
 *   9..           q - q_default [rad]
 *   9 + n..       qd times 0.05
 *   9 + 2 n..     last action [m]
 *   9 + 2 n + m.. those of TASK_FRAME_LIST (state.h) that the task has, the clock last */
#ifndef TASK_OBSERVE_H
#define TASK_OBSERVE_H

#include <math.h>
#include <string.h>

#include "base/random.h"
#include "env/task/assist.h"

#define TASK_RANDOM_NOISE 0x4e4f4953u

/* [held][shape.observation] The ring of the last frames, right behind TaskEnv. */
MILD_HD_FN TaskFrame *task_env_frames(TaskEnv *env) {
    return (TaskFrame *)(void *)(env + 1);
}

/* What the IMU says. rotation: [9] of the base; qvel: [6] its twist. */
MILD_HD_FN void task_read_imu(const Real *rotation, const Real *qvel, TaskSensors *sensors) {
    for (int i = 0; i < 3; i++) {
        sensors->omega[i] = qvel[3 + i];
        sensors->gravity[i] = -rotation[6 + i];
    }
}

/* What the motors say. q, qd: [TASK_JOINTS] angles and speeds. */
MILD_HD_FN void task_read_motors(const Real *q, const Real *qd, TaskSensors *sensors) {
    for (int i = 0; i < TASK_JOINTS; i++) {
        sensors->q[i] = q[i];
        sensors->qd[i] = qd[i];
    }
}

/* sin, cos of the gait clock; (0, 0) when standing: unlike the vendor's (0, 1) it is its own mirror
 * image. */
MILD_HD_FN Real observe_clock(const TaskEnv *env, const TaskDef *def, int cosine) {
    if (!def->clock || task_is_standing(def, env->command_seen)) {
        return 0;
    }
    return cosine ? task_cos(TASK_TWO_PI * env->phase) : task_sin(TASK_TWO_PI * env->phase);
}

/* A frame without noise. joint, speed: [joints]. */
MILD_HD_FN void observe_frame(const TaskEnv *env, const TaskDef *def, const double *pose,
                              const Real *omega, const Real *gravity, const Real *joint,
                              const Real *speed, float *frame) {
    int joints = env->shape.joints;
    for (int i = tile_lane(); i < 3; i += TILE) {
        frame[i] = (float)omega[i];
        frame[3 + i] = (float)(env->command_seen[i] * (i < 2 ? 2 : 1));
        frame[6 + i] = (float)gravity[i];
    }
    float *q = frame + 9, *qd = q + joints, *action = qd + joints,
          *last = action + env->shape.actions;
    for (int i = tile_lane(); i < joints; i += TILE) {
        q[i] = (float)(joint[i] - pose[i]);
        qd[i] = (float)(0.05 * speed[i]);
    }
    for (int i = tile_lane(); i < env->shape.actions; i += TILE) {
        action[i] = env->action[0][i];
    }
    if (tile_lane() == 0) {
#define OBSERVE_NUMBER(name, has, value, sign)                                                     \
    if (has) {                                                                                     \
        *last++ = (float)(value);                                                                  \
    }
        TASK_FRAME_LIST(OBSERVE_NUMBER)
    }
}

/* Two of the numbers of this policy step, uniform in [-1, 1). */
MILD_HD_FN void observe_draw_noise(const TaskEnv *env, int pair, double noise[2]) {
    Random r = random_at(env->seed ^ TASK_RANDOM_NOISE, env->index, env->tick);
    r.use = (uint32_t)(2 * pair);
    noise[0] = 2 * random_unit(&r) - 1;
    noise[1] = 2 * random_unit(&r) - 1;
}

MILD_HD_FN void observe_add_noise(const TaskEnv *env, const TaskDef *def, float *frame) {
    float *q = frame + 9, *qd = q + env->shape.joints;
    for (int pair = tile_lane(); pair < 3 + env->shape.joints; pair += TILE) {
        double noise[2];
        observe_draw_noise(env, pair, noise);
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
MILD_HD_FN void observe_to_base(const Real *rotation, const Real *v, float *out) {
    for (int i = 0; i < 3; i++) {
        out[i] = (float)(rotation[i] * v[0] + rotation[3 + i] * v[1] + rotation[6 + i] * v[2]);
    }
}

/* Velocity of the base, then velocities and heights of the feet. */
MILD_HD_FN void observe_estimates(const TaskEnv *env, const TaskDef *def,
                                  const RobotReading *reading, float *estimate) {
    int feet = env->shape.feet;
    for (int n = tile_lane(); n <= feet; n += TILE) {
        const int f = n > 0 ? n - 1 : 0;
        float *velocity = estimate + 3 * n;
        observe_to_base(reading->rotation,
                        n > 0 ? reading->foot[f].sole_center_velocity : env->robot.qvel, velocity);
        if (n > 0) {
            estimate[2 + 3 * feet + n] = (float)(def->height_scale * reading->foot[f].sole_height);
            continue;
        }
        for (int i = 0; i < 3; i++) {
            velocity[i] *= (float)def->velocity_scale;
        }
    }
}

/* Six numbers of each foot. */
MILD_HD_FN void observe_feet(const TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                             const RobotReading *reading, float *out) {
    const float force_scale = (float)(0.6 * robot->foot_force); /* [N] */
    for (int f = tile_lane(); f < env->shape.feet; f += TILE) {
        const Real *force = reading->foot[f].force;
        float *own = out + 6 * f;
        observe_to_base(reading->rotation, force, own);
        for (int i = 0; i < 3; i++) {
            float scaled = own[i] / force_scale;
            own[i] = scaled > 5 ? 5 : scaled < -5 ? -5 : scaled;
        }
        own[3] = force[2] > 5;
        own[4] = (float)task_gait_foot(def, robot, env->phase, env->command, f).stance;
        own[5] = (float)(10 * reading->foot[f].depth_mean);
    }
}

/* What was drawn for the episode. ground: see task_observe. */
MILD_HD_FN void observe_episode(const TaskEnv *env, const TaskDef *def, const RobotReading *reading,
                                const float *ground, float *out) {
    const TaskVariation *variation = &env->variation;
    float *const rest = out + 10 + TASK_GROUND_NUMBERS;
    for (int i = tile_lane(); i < 6; i += TILE) {
        out[i] = (float)env->push[i];
    }
    for (int i = tile_lane(); i < 3; i += TILE) {
        out[7 + i] = (float)(variation->com_offset[i] * 100);
        rest[9 + i] = (float)env->smooth_velocity[i];
    }
    for (int i = tile_lane(); i < TASK_GROUND_NUMBERS; i += TILE) {
        out[10 + i] = variation->rigid ? 0 : ground[i];
    }
    if (tile_lane() == 0) {
        const double step = def->physics_dt / TASK_PERIOD;
        out[6] = (float)(variation->base_mass_add / 4);
        rest[0] = (float)variation->rigid;
        rest[1] = (float)reading->above;
        rest[2] = (float)env->strength;
        rest[3] = (float)variation->armature_scale;
        rest[4] = (float)(env->lag_command * step);
        rest[5] = (float)(env->lag_motor * step);
        rest[6] = (float)(env->lag_imu * step);
        rest[7] = (float)variation->rigid_friction;
        rest[8] = (float)task_assist_share(env, def);
    }
}

/* By the lanes together. */
MILD_HD_FN void observe_copy(const float *from, int width, float *to) {
    for (int j = tile_lane(); j < width; j += TILE) {
        to[j] = from[j];
    }
}

/* Five means of older frames before the frame, which then takes the place of the oldest in the
 * ring. At the start of an episode the first frame also fills the older ones. */
MILD_HD_FN void observe_history(TaskEnv *env, const TaskDef *def, int first, float *history) {
    const int width = env->shape.observation, stride = def->history_stride;
    const uint32_t held = env->held;
    const float *frame = history + (TASK_FRAMES - 1) * width;
    for (int j = tile_lane(); j < width; j += TILE) {
        TaskFrame *column = task_env_frames(env) + j;
        uint32_t place = env->oldest;
        for (uint32_t k = 0; first && k < held; k++) {
            column[k * (uint32_t)width] = frame_pack(frame[j]);
        }
        for (int i = 0; i < TASK_FRAMES - 1; i++) {
            float sum = 0;
            TILE_UNROLL
            for (int k = 0; k < stride; k++) {
                sum += frame_unpack(column[place * (uint32_t)width]);
                place = place + 1 < held ? place + 1 : 0;
            }
            history[i * width + j] = sum / (float)stride;
        }
        column[place * (uint32_t)width] = frame_pack(frame[j]);
    }
}

/* Appends the frame made from the sensors to the history, first: bool, of an episode. Writes the
 * view, whose history must be there. reading, ground: for critic and estimate; the ground's numbers
 * [TASK_GROUND_NUMBERS] under the base. */
MILD_HD_FN void task_observe(TaskEnv *env, const TaskDef *def, const RobotTable *robot,
                             const RobotReading *reading, const float *ground,
                             const TaskSensors *sensors, int first, const EnvsView *view) {
    const double *pose = robot->default_pose;
    const int width = env->shape.observation;
    float *frame = view->history + (TASK_FRAMES - 1) * width;
    observe_frame(env, def, pose, sensors->omega, sensors->gravity, sensors->q, sensors->qd, frame);
    tile_sync();
    if (def->observe_noise) {
        observe_add_noise(env, def, frame);
        tile_sync();
    }
    observe_history(env, def, first, view->history);
    tile_sync();
    if (tile_lane() == 0) {
        env->oldest = (env->oldest + 1) % env->held;
    }
    if (view->frame) {
        observe_copy(frame, width, view->frame);
    }
    if (view->estimate) {
        observe_estimates(env, def, reading, view->estimate);
    }
    if (view->critic) {
        const Real *qpos = env->robot.qpos, *qvel = env->robot.qvel;
        const Real *rotation = reading->rotation;
        const Real gravity[3] = {-rotation[6], -rotation[7], -rotation[8]};
        observe_frame(env, def, pose, qvel + 3, gravity, qpos + 7, qvel + 6, view->critic);
        float *rest = view->critic + width;
        observe_estimates(env, def, reading, rest);
        observe_feet(env, def, robot, reading, rest + env->shape.estimates);
        observe_episode(env, def, reading, ground,
                        rest + env->shape.estimates + 6 * env->shape.feet);
    }
}

#endif
