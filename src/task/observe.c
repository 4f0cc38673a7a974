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
#include "task/task.h"

#define TWO_PI 6.283185307179586
#define RANDOM_USE_NOISE 0x4e4f4953u

TASK_FN void task_read_imu(const RobotSim *sim, TaskReading *reading) {
    const double *rotation = robot_sim_base_rotation(sim), *qvel = robot_sim_qvel(sim);
    for (int i = 0; i < 3; i++) {
        reading->omega[i] = qvel[3 + i];
        reading->gravity[i] = -rotation[6 + i];
    }
}

TASK_FN void task_read_motors(const RobotSim *sim, TaskReading *reading) {
    memcpy(reading->q, robot_sim_qpos(sim) + 7, sizeof reading->q);
    memcpy(reading->qd, robot_sim_qvel(sim) + 6, sizeof reading->qd);
}

static inline MILD_BOTH void make_frame(const TaskEnv *env, const TaskDef *def, const double *pose,
                                        const TaskReading *reading, float *frame) {
    const double command_scale[3] = {2, 2, 1};
    int joints = env->shape.joints;
    for (int i = 0; i < 3; i++) {
        frame[i] = (float)reading->omega[i];
        frame[3 + i] = (float)(env->command_seen[i] * command_scale[i]);
        frame[6 + i] = (float)reading->gravity[i];
    }
    float *q = frame + 9, *qd = q + joints, *action = qd + joints, *clock = action + joints;
    for (int i = 0; i < joints; i++) {
        q[i] = (float)(reading->q[i] - pose[i]);
        qd[i] = (float)(0.05 * reading->qd[i]);
        action[i] = env->action[0][i];
    }
    int standing = task_is_standing(env->command_seen);
    clock[0] = def->clock ? (float)(standing ? 0 : sin(TWO_PI * env->phase)) : 0;
    clock[1] = def->clock ? (float)(standing ? 0 : cos(TWO_PI * env->phase)) : 0;
}

static inline MILD_BOTH void add_noise(const TaskEnv *env, const TaskDef *def, float *frame) {
    Random r = random_at(env->seed ^ RANDOM_USE_NOISE, env->index, env->tick);
    float *q = frame + 9, *qd = q + env->shape.joints;
    for (int i = 0; i < 3; i++) {
        frame[i] += (float)(def->noise_omega * (2 * random_unit(&r) - 1));
        frame[6 + i] += (float)(def->noise_gravity * (2 * random_unit(&r) - 1));
    }
    for (int i = 0; i < env->shape.joints; i++) {
        q[i] += (float)(def->noise_q * (2 * random_unit(&r) - 1));
        qd[i] += (float)(def->noise_qd * (2 * random_unit(&r) - 1));
    }
}

/* Rotates a world vector into the base frame. */
static inline MILD_BOTH void to_base(const double *rotation, const double *v, float *out) {
    for (int i = 0; i < 3; i++) {
        out[i] = (float)(rotation[i] * v[0] + rotation[3 + i] * v[1] + rotation[6 + i] * v[2]);
    }
}

static inline MILD_BOTH void write_estimates(const TaskEnv *env, const RobotSim *sim,
                                             float *estimate) {
    const double *rotation = robot_sim_base_rotation(sim);
    int feet = env->shape.feet;
    to_base(rotation, robot_sim_qvel(sim), estimate);
    for (int i = 0; i < 3; i++) {
        estimate[i] *= (float)TASK_VELOCITY_SCALE;
    }
    for (int f = 0; f < feet; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        to_base(rotation, foot->sole_center_velocity, estimate + 3 + 3 * f);
        estimate[3 + 3 * feet + f] = (float)(TASK_HEIGHT_SCALE * foot->sole_height);
    }
}

/* Material under the base, with each parameter scaled to about one. Parameters of an element that
 * represents a whole sole are converted to those of one of its cells. */
static inline MILD_BOTH float *write_ground(const TaskEnv *env, const Robot *robot,
                                            const RobotSim *sim, float *out) {
    const double *qpos = robot_sim_qpos(sim);
    const MildMaterial *m = place_material(&env->terrain, qpos[0], qpos[1]);
    double cells = place_cells(robot, m->model);
    const double values[] = {m->k_pen / 500 / cells,
                             m->sigma_cone / 1e5,
                             m->alpha,
                             m->nu,
                             m->c_g / 4,
                             m->c_d / 20,
                             m->phi,
                             m->mu,
                             m->k_drift / 500 / cells,
                             m->b_drift * 10 / cells,
                             m->recovery,
                             m->bed_depth * 10};
    int rigid = env->variation.rigid;
    for (size_t i = 0; i < sizeof values / sizeof *values; i++) {
        *out++ = rigid ? 0 : (float)values[i];
    }
    *out++ = (float)rigid;
    return out;
}

static inline MILD_BOTH void write_critic(const TaskEnv *env, const TaskDef *def,
                                          const Robot *robot, const RobotSim *sim,
                                          const float *clean, float *critic) {
    float *out = critic;
    memcpy(out, clean, (size_t)env->shape.observation * sizeof *out);
    out += env->shape.observation;
    write_estimates(env, sim, out);
    out += env->shape.estimates;
    const double *rotation = robot_sim_base_rotation(sim);
    int standing = task_is_standing(env->command);
    const float force_scale = (float)(0.6 * robot_foot_force(robot)); /* [N] */
    for (int f = 0; f < env->shape.feet; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        to_base(rotation, foot->force, out);
        for (int i = 0; i < 3; i++) {
            float scaled = out[i] / force_scale;
            out[i] = scaled > 5 ? 5 : scaled < -5 ? -5 : scaled;
        }
        out[3] = foot->force[2] > 5;
        out[4] = (float)task_gait_stance(robot, env->phase, standing, f);
        out[5] = (float)(10 * foot->result.depth_mean);
        out += 6;
    }
    for (int i = 0; i < 6; i++) {
        *out++ = (float)env->push[i];
    }
    *out++ = (float)(env->variation.base_mass_add / 4);
    for (int i = 0; i < 3; i++) {
        *out++ = (float)(env->variation.com_offset[i] * 100);
    }
    out = write_ground(env, robot, sim, out);
    *out++ = (float)(robot_sim_qpos(sim)[2] -
                     place_height(&env->terrain, robot_sim_qpos(sim)[0], robot_sim_qpos(sim)[1]));
    *out++ = (float)env->strength[0];
    *out++ = (float)env->variation.armature_scale;
    double step = def->physics_dt / TASK_PERIOD;
    *out++ = (float)(env->lag_command * step);
    *out++ = (float)(env->lag_motor * step);
    *out++ = (float)(env->lag_imu * step);
    *out++ = (float)env->variation.rigid_friction;
    *out++ = (float)task_assist_share(env, def);
    for (int i = 0; i < 3; i++) {
        *out++ = (float)env->smooth_velocity[i];
    }
}

/* Stores a frame. At the start of an episode the first frame also fills the older ones. */
static inline MILD_BOTH void remember(TaskEnv *env, const TaskDef *def, const float *frame,
                                      int first) {
    int width = env->shape.observation;
    size_t bytes = (size_t)width * sizeof *frame;
    float *history = task_env_history(env);
    env->newest = (env->newest + 1) % env->held;
    for (int age = 0; age < (first ? (int)env->held : 1); age++) {
        memcpy(task_env_frame(env, age), frame, bytes);
    }
    memcpy(history + env->shape.history - width, frame, bytes);
    for (int i = 0; i < TASK_FRAMES - 1; i++) {
        float *mean = history + i * width;
        int oldest = (TASK_FRAMES - 1 - i) * def->history_stride;
        memcpy(mean, task_env_frame(env, oldest), bytes);
        for (int k = 1; k < def->history_stride; k++) {
            const float *next = task_env_frame(env, oldest - k);
            for (int j = 0; j < width; j++) {
                mean[j] += next[j];
            }
        }
        for (int j = 0; j < width; j++) {
            mean[j] /= (float)def->history_stride;
        }
    }
}

TASK_FN void task_observe(TaskEnv *env, const TaskDef *def, const Robot *robot, const RobotSim *sim,
                          const TaskReading *reading, int first, const TaskView *view) {
    const double *pose = robot_default_pose(robot);
    float frame[TASK_OBSERVATION_MAX];
    make_frame(env, def, pose, reading, frame);
    if (def->observe_noise) {
        add_noise(env, def, frame);
    }
    remember(env, def, frame, first);
    if (view->history) {
        memcpy(view->history, task_env_history(env), (size_t)env->shape.history * sizeof(float));
    }
    if (view->frame) {
        memcpy(view->frame, frame, (size_t)env->shape.observation * sizeof *frame);
    }
    if (view->estimate) {
        write_estimates(env, sim, view->estimate);
    }
    if (view->critic) {
        TaskReading now;
        float clean[TASK_OBSERVATION_MAX];
        task_read_imu(sim, &now);
        task_read_motors(sim, &now);
        make_frame(env, def, pose, &now, clean);
        write_critic(env, def, robot, sim, clean, view->critic);
    }
}
