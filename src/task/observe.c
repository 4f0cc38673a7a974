/* Observations (docs/task.md section 5). One frame:
 *   0..2   base angular velocity, base frame [rad/s]
 *   3..5   command (vx, vy, wz) times (2, 2, 1)
 *   6..8   unit gravity in the base frame
 *   9..20  q - q_default [rad]
 *   21..32 qd times 0.05
 *   33..44 last action
 *   45..46 sin, cos of the gait clock; (0, 0) when standing: unlike the vendor's (0, 1) it is its
 * own mirror image */
#include <math.h>
#include <string.h>

#include "base/random.h"
#include "task/task.h"

#define TWO_PI 6.283185307179586
#define RANDOM_USE_NOISE 0x4e4f4953u

/* Mirror in the x-z plane: y components, roll, yaw and their rates change sign; legs change places;
 * the clock turns by half a period, (sin, cos) -> (-sin, -cos). */
#define LEG(first) first, first + 1, first + 2, first + 3, first + 4, first + 5
#define LEG_SIGN -1, -1, 1, 1, 1, -1
const int task_mirror_observation_index[TASK_OBSERVATION] = {
    0, 1, 2, 3, 4, 5, 6, 7, 8, LEG(15), LEG(9), LEG(27), LEG(21), LEG(39), LEG(33), 45, 46};
const float task_mirror_observation_sign[TASK_OBSERVATION] = {
    -1,       1,        -1,       1,        -1,       -1,       1,  -1, 1,
    LEG_SIGN, LEG_SIGN, LEG_SIGN, LEG_SIGN, LEG_SIGN, LEG_SIGN, -1, -1};
const int task_mirror_action_index[TASK_ACTIONS] = {LEG(6), LEG(0)};
const float task_mirror_action_sign[TASK_ACTIONS] = {LEG_SIGN, LEG_SIGN};

void task_read_imu(const RobotSim *sim, TaskReading *reading) {
    const double *rotation = robot_sim_base_rotation(sim), *qvel = robot_sim_qvel(sim);
    for (int i = 0; i < 3; i++) {
        reading->omega[i] = qvel[3 + i];
        reading->gravity[i] = -rotation[6 + i];
    }
}

void task_read_motors(const RobotSim *sim, TaskReading *reading) {
    memcpy(reading->q, robot_sim_qpos(sim) + 7, sizeof reading->q);
    memcpy(reading->qd, robot_sim_qvel(sim) + 6, sizeof reading->qd);
}

static void make_frame(const TaskEnv *env, const TaskDef *def, const double *pose,
                       const TaskReading *reading, float frame[TASK_OBSERVATION]) {
    const double command_scale[3] = {2, 2, 1};
    for (int i = 0; i < 3; i++) {
        frame[i] = (float)reading->omega[i];
        frame[3 + i] = (float)(env->command_seen[i] * command_scale[i]);
        frame[6 + i] = (float)reading->gravity[i];
    }
    for (int i = 0; i < ROBOT_JOINTS; i++) {
        frame[9 + i] = (float)(reading->q[i] - pose[i]);
        frame[21 + i] = (float)(0.05 * reading->qd[i]);
        frame[33 + i] = env->action[0][i];
    }
    int standing = task_is_standing(env->command_seen);
    frame[45] = def->clock ? (float)(standing ? 0 : sin(TWO_PI * env->phase)) : 0;
    frame[46] = def->clock ? (float)(standing ? 0 : cos(TWO_PI * env->phase)) : 0;
}

static void add_noise(const TaskEnv *env, const TaskDef *def, float frame[TASK_OBSERVATION]) {
    Random r = random_at(env->seed ^ RANDOM_USE_NOISE, env->index, env->tick);
    for (int i = 0; i < 3; i++) {
        frame[i] += (float)(def->noise_omega * (2 * random_unit(&r) - 1));
        frame[6 + i] += (float)(def->noise_gravity * (2 * random_unit(&r) - 1));
    }
    for (int i = 0; i < ROBOT_JOINTS; i++) {
        frame[9 + i] += (float)(def->noise_q * (2 * random_unit(&r) - 1));
        frame[21 + i] += (float)(def->noise_qd * (2 * random_unit(&r) - 1));
    }
}

/* World vector into the base frame. */
static void to_base(const double *rotation, const double *v, float *out) {
    for (int i = 0; i < 3; i++) {
        out[i] = (float)(rotation[i] * v[0] + rotation[3 + i] * v[1] + rotation[6 + i] * v[2]);
    }
}

static void write_estimates(const RobotSim *sim, float *estimate) {
    const double *rotation = robot_sim_base_rotation(sim);
    to_base(rotation, robot_sim_qvel(sim), estimate);
    for (int i = 0; i < 3; i++) {
        estimate[i] *= (float)TASK_VELOCITY_SCALE;
    }
    for (int f = 0; f < ROBOT_FEET; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        to_base(rotation, foot->sole_center_velocity, estimate + 3 + 3 * f);
        estimate[9 + f] = (float)(TASK_HEIGHT_SCALE * foot->sole_height);
    }
}

/* Ground under the base, each parameter scaled to about one; an element that stands for a whole
 * sole as one of its cells. */
static float *write_ground(const TaskEnv *env, const Robot *robot, const RobotSim *sim,
                           float *out) {
    const double *qpos = robot_sim_qpos(sim);
    const MildMaterial *m =
        &env->terrain.materials[mild_terrain_material_at(&env->terrain, qpos[0], qpos[1])];
    double cells = mild_model_is_concentric((MildModel)m->model)
                       ? mild_sole_elements(robot_rasters(robot)[0])
                       : 1;
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

static void write_critic(const TaskEnv *env, const TaskDef *def, const Robot *robot,
                         const RobotSim *sim, const float *clean, float *critic) {
    float *out = critic;
    memcpy(out, clean, TASK_OBSERVATION * sizeof *out);
    out += TASK_OBSERVATION;
    write_estimates(sim, out);
    out += TASK_ESTIMATES;
    const double *rotation = robot_sim_base_rotation(sim);
    int standing = task_is_standing(env->command);
    for (int f = 0; f < ROBOT_FEET; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        to_base(rotation, foot->force, out);
        for (int i = 0; i < 3; i++) {
            float scaled = out[i] / 300;
            out[i] = scaled > 5 ? 5 : scaled < -5 ? -5 : scaled;
        }
        out[3] = foot->force[2] > 5;
        out[4] = (float)task_gait_stance(env->phase, standing, f);
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
    *out++ = (float)(robot_sim_qpos(sim)[2] - mild_terrain_height_at(&env->terrain,
                                                                     robot_sim_qpos(sim)[0],
                                                                     robot_sim_qpos(sim)[1]));
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

static float *frame_back(TaskEnv *env, int age) {
    return env->frames[(env->newest + TASK_FRAMES_HELD - (uint32_t)age) % TASK_FRAMES_HELD];
}

/* An episode's first frame stands for those before it. */
static void remember(TaskEnv *env, const TaskDef *def, const float frame[TASK_OBSERVATION],
                     int first) {
    const size_t bytes = sizeof env->frames[0];
    env->newest = (env->newest + 1) % TASK_FRAMES_HELD;
    for (int age = 0; age < (first ? TASK_FRAMES_HELD : 1); age++) {
        memcpy(frame_back(env, age), frame, bytes);
    }
    memcpy(env->history + TASK_HISTORY - TASK_OBSERVATION, frame, bytes);
    for (int i = 0; i < TASK_FRAMES - 1; i++) {
        float *mean = env->history + i * TASK_OBSERVATION;
        int oldest = (TASK_FRAMES - 1 - i) * def->history_stride;
        memcpy(mean, frame_back(env, oldest), bytes);
        for (int k = 1; k < def->history_stride; k++) {
            const float *next = frame_back(env, oldest - k);
            for (int j = 0; j < TASK_OBSERVATION; j++) {
                mean[j] += next[j];
            }
        }
        for (int j = 0; j < TASK_OBSERVATION; j++) {
            mean[j] /= (float)def->history_stride;
        }
    }
}

void task_observe(TaskEnv *env, const TaskDef *def, const Robot *robot, const RobotSim *sim,
                  const TaskReading *reading, int first, const TaskView *view) {
    const double *pose = robot_default_pose(robot);
    float frame[TASK_OBSERVATION];
    make_frame(env, def, pose, reading, frame);
    if (def->observe_noise) {
        add_noise(env, def, frame);
    }
    remember(env, def, frame, first);
    if (view->history) {
        memcpy(view->history, env->history, sizeof env->history);
    }
    if (view->frame) {
        memcpy(view->frame, frame, sizeof frame);
    }
    if (view->estimate) {
        write_estimates(sim, view->estimate);
    }
    if (view->critic) {
        TaskReading now;
        float clean[TASK_OBSERVATION];
        task_read_imu(sim, &now);
        task_read_motors(sim, &now);
        make_frame(env, def, pose, &now, clean);
        write_critic(env, def, robot, sim, clean, view->critic);
    }
}
