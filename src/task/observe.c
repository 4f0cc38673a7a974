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
    const TaskReal *rotation = robot_sim_base_rotation(sim), *qvel = robot_sim_qvel(sim);
    for (int i = 0; i < 3; i++) {
        reading->omega[i] = qvel[3 + i];
        reading->gravity[i] = -rotation[6 + i];
    }
}

TASK_FN void task_read_motors(const RobotSim *sim, TaskReading *reading) {
    memcpy(reading->q, robot_sim_qpos(sim) + 7, sizeof reading->q);
    memcpy(reading->qd, robot_sim_qvel(sim) + 6, sizeof reading->qd);
}

/* Entries of a frame that lane `lane` of `lanes` writes, without noise. q, qd: [joints]. */
static inline MILD_BOTH void make_frame(const TaskEnv *env, const TaskDef *def, const double *pose,
                                        const TaskReal *omega, const TaskReal *gravity,
                                        const TaskReal *joint, const TaskReal *speed, TaskLane at,
                                        float *frame) {
    int joints = env->shape.joints;
    for (int i = at.lane; i < 3; i += at.lanes) {
        frame[i] = (float)omega[i];
        frame[3 + i] = (float)(env->command_seen[i] * (i < 2 ? 2 : 1));
        frame[6 + i] = (float)gravity[i];
    }
    float *q = frame + 9, *qd = q + joints, *action = qd + joints, *clock = action + joints;
    for (int i = at.lane; i < joints; i += at.lanes) {
        q[i] = (float)(joint[i] - pose[i]);
        qd[i] = (float)(0.05 * speed[i]);
        action[i] = env->action[0][i];
    }
    if (at.lane == 0) {
        int still = !def->clock || task_is_standing(env->command_seen);
        clock[0] = still ? 0 : (float)place_sin(TWO_PI * env->phase);
        clock[1] = still ? 0 : (float)place_cos(TWO_PI * env->phase);
    }
}

/* Two of the numbers of this policy step, uniform in [-1, 1). */
static inline MILD_BOTH void draw_noise(const TaskEnv *env, int pair, double noise[2]) {
    Random r = random_at(env->seed ^ RANDOM_USE_NOISE, env->index, env->tick);
    r.use = (uint32_t)(2 * pair);
    noise[0] = 2 * random_unit(&r) - 1;
    noise[1] = 2 * random_unit(&r) - 1;
}

/* To the entries that this lane has written. */
static inline MILD_BOTH void add_noise(const TaskEnv *env, const TaskDef *def, TaskLane at,
                                       float *frame) {
    float *q = frame + 9, *qd = q + env->shape.joints;
    double noise[2];
    for (int i = at.lane; i < 3; i += at.lanes) {
        draw_noise(env, i, noise);
        frame[i] += (float)(def->noise_omega * noise[0]);
        frame[6 + i] += (float)(def->noise_gravity * noise[1]);
    }
    for (int i = at.lane; i < env->shape.joints; i += at.lanes) {
        draw_noise(env, 3 + i, noise);
        q[i] += (float)(def->noise_q * noise[0]);
        qd[i] += (float)(def->noise_qd * noise[1]);
    }
}

/* Rotates a world vector into the base frame. */
static inline MILD_BOTH void to_base(const TaskReal *rotation, const TaskReal *v, float *out) {
    for (int i = 0; i < 3; i++) {
        out[i] = (float)(rotation[i] * v[0] + rotation[3 + i] * v[1] + rotation[6 + i] * v[2]);
    }
}

static inline MILD_BOTH void write_estimates(const TaskEnv *env, const RobotSim *sim,
                                             float *estimate) {
    const TaskReal *rotation = robot_sim_base_rotation(sim);
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
static inline MILD_BOTH float *write_ground(const TaskEnv *env, const TaskDef *def,
                                            const Robot *robot, const RobotSim *sim, float *out) {
    const MildMaterial *m = task_material_under(env, def, sim);
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

/* What follows the frame in the critic's row. */
static inline MILD_BOTH void write_critic(const TaskEnv *env, const TaskDef *def,
                                          const Robot *robot, const RobotSim *sim, float *out) {
    write_estimates(env, sim, out);
    out += env->shape.estimates;
    const TaskReal *rotation = robot_sim_base_rotation(sim);
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
    out = write_ground(env, def, robot, sim, out);
    *out++ = (float)place_above(sim, &env->terrain);
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

static inline MILD_BOTH void copy_row(const float *from, int width, TaskLane at, float *to) {
    for (int j = at.lane; j < width; j += at.lanes) {
        to[j] = from[j];
    }
}

/* Five means of older frames before the frame, which then takes the place of the oldest in the
 * ring. At the start of an episode the first frame also fills the older ones. */
static inline MILD_BOTH void write_history(TaskEnv *env, const TaskDef *def, int first, TaskLane at,
                                           float *history) {
    int width = env->shape.observation, stride = def->history_stride;
    const float *frame = history + (TASK_FRAMES - 1) * width;
    for (int j = at.lane; j < width; j += at.lanes) {
        TaskFrame *column = task_env_frames(env) + j;
        uint32_t place = env->oldest;
        for (uint32_t k = 0; first && k < env->held; k++) {
            column[k * (uint32_t)width] = place_pack(frame[j]);
        }
        for (int i = 0; i < TASK_FRAMES - 1; i++) {
            float sum = 0;
            PLACE_UNROLL
            for (int k = 0; k < stride; k++) {
                sum += place_unpack(column[place * (uint32_t)width]);
                place = place + 1 < env->held ? place + 1 : 0;
            }
            history[i * width + j] = sum / (float)stride;
        }
        column[place * (uint32_t)width] = place_pack(frame[j]);
    }
}

TASK_FN void task_observe_lane(TaskEnv *env, const TaskDef *def, const Robot *robot,
                               const RobotSim *sim, const TaskReading *reading, int first,
                               const TaskView *view, TaskLane at) {
    const double *pose = robot_default_pose(robot);
    float *history = PLACE_HISTORY ? task_env_history(env) : view->history;
    float *frame = history + (TASK_FRAMES - 1) * env->shape.observation;
    make_frame(env, def, pose, reading->omega, reading->gravity, reading->q, reading->qd, at,
               frame);
    if (def->observe_noise) {
        add_noise(env, def, at, frame);
    }
    place_meet();
    write_history(env, def, first, at, history);
    place_meet();
    if (at.lane == 0) {
        env->oldest = (env->oldest + 1) % env->held;
    }
    if (view->history && view->history != history) {
        copy_row(history, env->shape.history, at, view->history);
    }
    if (view->frame) {
        copy_row(frame, env->shape.observation, at, view->frame);
    }
    if (view->estimate && at.lane == 0) {
        write_estimates(env, sim, view->estimate);
    }
    if (view->critic) {
        const TaskReal *qpos = robot_sim_qpos(sim), *qvel = robot_sim_qvel(sim);
        const TaskReal *rotation = robot_sim_base_rotation(sim);
        const TaskReal gravity[3] = {-rotation[6], -rotation[7], -rotation[8]};
        make_frame(env, def, pose, qvel + 3, gravity, qpos + 7, qvel + 6, at, view->critic);
        if (at.lane == at.lanes - 1) {
            write_critic(env, def, robot, sim, view->critic + env->shape.observation);
        }
    }
}

TASK_FN void task_observe(TaskEnv *env, const TaskDef *def, const Robot *robot, const RobotSim *sim,
                          const TaskReading *reading, int first, const TaskView *view) {
    const TaskLane alone = {0, 1};
    task_observe_lane(env, def, robot, sim, reading, first, view, alone);
}
