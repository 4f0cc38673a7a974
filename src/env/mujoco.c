/* Environments that MuJoCo steps on all cores of the CPU, each writing directly into the learner's
 * rows. */
#include "env/backend.h"

#include <stdlib.h>
#include <string.h>

#include "env/task/task.h"
#include "robot/float/float_ground.h"

typedef struct {
    Envs base;
    TaskDef def;
    TaskShape shape;
    const Robot *robot;
    Pool *pool;
    size_t stride;
    char *state;          /* [count][stride] TaskEnv and ground memory */
    TaskStep *result;     /* [count] of the last step */
    RobotSim **sim;       /* [threads] */
    RobotPhases *phases;  /* [threads] */
    RobotGround **single; /* [threads] with task.contact_float, else NULL */
    EnvsStats stats;      /* sums */
    /* of trials, else NULL */
    const EnvsTrial *trial; /* [count] */
    const MildTerrain *terrain;
    uint8_t *over; /* [count] bool: the trial ended by a fall; its robot stays as it is */
    EnvsDrive drive;
    const RobotGround *ground; /* [count] or NULL */
    EnvsSample *sample;        /* [count][physics steps] of the caller; NULL: none */
    /* arguments of the call in flight */
    const EnvsStep *step;
    const EnvsView *view;
} Mujoco;

static Mujoco *own(Envs *envs) {
    return (Mujoco *)(void *)envs;
}

static const Mujoco *own_const(const Envs *envs) {
    return (const Mujoco *)(const void *)envs;
}

static TaskEnv *env_at(const Mujoco *m, int i) {
    return (TaskEnv *)(void *)(m->state + (size_t)i * m->stride);
}

/* ---- creation ---- */

static void destroy(Envs *envs) {
    Mujoco *m = own(envs);
    for (int i = 0; m->sim && i < pool_threads(m->pool); i++) {
        robot_sim_destroy(m->sim[i]);
    }
    for (int i = 0; m->single && i < pool_threads(m->pool); i++) {
        float_ground_destroy(m->single[i]);
    }
    free(m->sim);
    free(m->single);
    free(m->phases);
    free(m->result);
    free(m->state);
    free(m->over);
    free(m);
}

static MildStatus open_arrays(Mujoco *m, MildError *error) {
    const size_t count = (size_t)m->base.count, threads = (size_t)pool_threads(m->pool);
    m->state = aligned_alloc(64, count * m->stride);
    m->result = calloc(count, sizeof *m->result);
    m->sim = calloc(threads, sizeof(RobotSim *));
    m->single = m->def.contact_float ? calloc(threads, sizeof(RobotGround *)) : NULL;
    m->phases = calloc(threads, sizeof *m->phases);
    m->over = calloc(count, sizeof *m->over);
    return m->state && m->result && m->sim && m->phases && m->over &&
                   (m->single || !m->def.contact_float)
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_MEMORY, "environments: out of memory for %d",
                           m->base.count);
}

static MildStatus open_sims(Mujoco *m, MildError *error) {
    for (int i = 0; i < pool_threads(m->pool); i++) {
        m->sim[i] = robot_sim_create(m->robot, m->def.physics_dt, error);
        if (m->sim[i] && m->single) {
            m->single[i] = float_ground_create(m->robot, error);
        }
        if (!m->sim[i] || (m->single && !m->single[i])) {
            return error->status;
        }
        robot_sim_time_phases(m->sim[i], &m->phases[i]);
    }
    return MILD_OK;
}

static void init_envs(Mujoco *m, const EnvsDef *def) {
    for (int i = 0; i < def->count; i++) {
        const uint32_t stream = m->trial ? m->trial[i].stream : def->first + (uint32_t)i;
        task_env_init(env_at(m, i), &m->def, m->robot, def->seed, stream);
    }
}

/* ---- steps ---- */

static void reset_piece(void *context, int piece, int thread) {
    Mujoco *m = context;
    EnvsView view = task_view_from(m->view, &m->shape, piece);
    TaskEnv *env = env_at(m, piece);
    RobotSim *sim = m->sim[thread];
    if (m->trial) {
        const EnvsTrial *trial = &m->trial[piece];
        task_env_reset_on(env, &m->def, m->robot, sim, &m->terrain[trial->ground], trial->rigid,
                          &view);
        m->over[piece] = 0;
    } else {
        task_env_reset(env, &m->def, m->robot, sim, &view);
    }
}

static MildStatus reset(Envs *envs, const EnvsView *first, MildStream stream, MildError *error) {
    Mujoco *m = own(envs);
    (void)stream;
    (void)error;
    m->view = first;
    pool_run(m->pool, m->base.count, reset_piece, m);
    return MILD_OK;
}

static void copy_row(const float *from, int width, int valid, float *to) {
    if (from && to) {
        memset(to, 0, (size_t)width * sizeof *to);
        memcpy(to, from, valid ? (size_t)width * sizeof *to : 0);
    }
}

/* The end of an episode is seen where the next observation will be, and copied from there. */
static void copy_last(const Mujoco *m, int piece, const EnvsView *view) {
    const TaskShape *shape = &m->shape;
    const EnvsView last = task_view_from(&m->step->last, &m->shape, piece);
    const int valid = m->result[piece].valid;
    copy_row(view->history, shape->history, valid, last.history);
    copy_row(view->critic, shape->critic, valid, last.critic);
    copy_row(view->estimate, shape->estimates, valid, last.estimate);
    copy_row(view->frame, shape->observation, valid, last.frame);
}

/* An environment in a policy step, for its TaskCallback and TaskDrive. */
typedef struct {
    const Mujoco *m;
    int env;
    EnvsSample *sample; /* of the next physics step; NULL: none */
} Sampling;

static void watch(void *context, const TaskEnv *env, const RobotSim *sim, const double *torque) {
    Sampling *sampling = context;
    if (sampling->sample) {
        envs_read_sample(env, sim, torque, sampling->sample++);
    }
}

static void drive(void *context, const TaskEnv *env, RobotSim *sim, double *torque) {
    const Sampling *sampling = context;
    const EnvsDrive *by = &sampling->m->drive;
    by->torque(by->self, sampling->env, env, sim, torque);
}

/* The policy step of an environment; again: bool, a new episode follows where it ends. */
static TaskStep step_env(const Mujoco *m, int i, int thread, int again, const EnvsView *view) {
    RobotSim *sim = m->sim[thread];
    const size_t steps = (size_t)m->base.physics_steps;
    const float *action = m->step->action + (size_t)i * (size_t)m->shape.actions;
    Sampling sampling = {m, i, m->sample ? m->sample + (size_t)i * steps : NULL};
    const TaskDrive driven = {drive, &sampling};
    robot_sim_set_ground(sim, m->ground ? &m->ground[i] : m->single ? m->single[thread] : NULL);
    const TaskCallback callback = {watch, &sampling, m->drive.torque ? &driven : NULL};
    for (size_t k = 0; m->sample && k < steps; k++) {
        sampling.sample[k].valid = 0;
    }
    return task_env_step(env_at(m, i), &m->def, m->robot, sim, action, again, view,
                         m->sample || m->drive.torque ? &callback : NULL);
}

static void step_piece(void *context, int piece, int thread) {
    Mujoco *m = context;
    const EnvsStep *step = m->step;
    EnvsView view = task_view_from(&step->next, &m->shape, piece);
    TaskEnv *env = env_at(m, piece);
    TaskStep *result = &m->result[piece];
    const int last = step->last.history != NULL;
    if (m->trial && m->over[piece]) {
        *result = (TaskStep){.valid = 1};
        return;
    }
    *result = step_env(m, piece, thread, !last && !m->trial, &view);
    if (m->trial) {
        m->over[piece] = result->done && !result->timeout;
    } else if (result->done && last) {
        copy_last(m, piece, &view);
        task_env_reset(env, &m->def, m->robot, m->sim[thread], &view);
    }
    if (result->done && step->terms) {
        memcpy(step->terms + (size_t)piece * TASK_REWARD_COUNT, result->episode_terms,
               sizeof result->episode_terms);
    }
}

static void add_episode(EnvsStats *stats, const TaskStep *result) {
    stats->episodes++;
    stats->falls += !result->timeout;
    stats->length += result->length * TASK_PERIOD;
    stats->reward += (double)result->episode_reward;
    stats->speed_error += (double)result->episode_speed_error;
    for (int i = 0; i < TASK_REWARD_COUNT; i++) {
        stats->terms[i] += (double)result->episode_terms[i];
    }
}

static MildStatus step(Envs *envs, const EnvsStep *step, MildStream stream, MildError *error) {
    Mujoco *m = own(envs);
    EnvsStats *stats = &m->stats;
    (void)stream;
    (void)error;
    m->step = step;
    pool_run(m->pool, m->base.count, step_piece, m);
    for (int i = 0; i < m->base.count; i++) {
        const TaskStep *result = &m->result[i];
        step->reward[i] = result->reward;
        step->done[i] = result->done;
        step->timeout[i] = result->timeout;
        step->valid[i] = result->valid;
        if (step->cause) {
            step->cause[i] = result->cause;
        }
        stats->diverged += !result->valid;
        stats->paid += (double)result->reward;
        if (result->done) {
            add_episode(stats, result);
        }
    }
    stats->steps += m->base.count;
    return MILD_OK;
}

static MildStatus wait(Envs *envs, MildError *error) {
    (void)envs;
    (void)error;
    return MILD_OK;
}

/* ---- trials ---- */

static MildStatus set_commands(Envs *envs, const double *command, MildError *error) {
    const Mujoco *m = own(envs);
    (void)error;
    for (int i = 0; i < m->base.count; i++) {
        TaskEnv *env = env_at(m, i);
        env->command_frozen = 1;
        memcpy(env->command, command + TASK_COMMANDS * (size_t)i, sizeof env->command);
    }
    return MILD_OK;
}

static void set_samples(Envs *envs, EnvsSample *sample) {
    own(envs)->sample = sample;
}

static TaskEnv *env_of(Envs *envs, int i) {
    return env_at(own(envs), i);
}

void envs_read_sample(const TaskEnv *env, const RobotSim *sim, const double *torque,
                      EnvsSample *sample) {
    const size_t joints = (size_t)env->shape.joints;
    const double *qpos = robot_sim_qpos(sim);
    sample->valid = 1;
    sample->joints = env->shape.joints;
    sample->feet = env->shape.feet;
    memcpy(sample->base, qpos, sizeof sample->base);
    sample->above = qpos[2] - mild_terrain_height_at(task_env_terrain(env), qpos[0], qpos[1]);
    sample->legs = robot_sim_leg_distance(sim);
    sample->shell_load = robot_sim_shell_load(sim);
    memcpy(sample->quaternion, qpos + 3, sizeof sample->quaternion);
    memcpy(sample->mass_center, robot_sim_mass_center(sim), sizeof sample->mass_center);
    memcpy(sample->torque, torque, joints * sizeof *torque);
    memcpy(sample->omega, robot_sim_qvel(sim) + 3, sizeof sample->omega);
    memcpy(sample->speed, robot_sim_qvel(sim) + 6, joints * sizeof *sample->speed);
    for (int f = 0; f < sample->feet; f++) {
        const RobotFoot *foot = robot_sim_foot(sim, f);
        sample->foot[f] = (EnvsFoot){
            .load = foot->force[2],
            .center = {foot->sole_center[0], foot->sole_center[1]},
            .height = foot->sole_height,
            .depth = env->variation.rigid ? 0 : foot->result.depth_max,
        };
        memcpy(sample->foot[f].position, foot->position, sizeof foot->position);
        memcpy(sample->foot[f].rotation, foot->rotation, sizeof foot->rotation);
        memcpy(sample->foot[f].force, foot->force, sizeof foot->force);
        memcpy(sample->foot[f].torque, foot->torque, sizeof foot->torque);
    }
}

/* ---- statistics ---- */

static MildStatus sums(Envs *envs, EnvsStats *sums, MildStream stream, MildError *error) {
    Mujoco *m = own(envs);
    (void)stream;
    (void)error;
    *sums = m->stats;
    for (int i = 0; i < m->base.count; i++) {
        sums->assist += task_assist_share(env_at(m, i), &m->def);
    }
    memset(&m->stats, 0, sizeof m->stats);
    return MILD_OK;
}

static void times(Envs *envs, double *physics, double *ground) {
    Mujoco *m = own(envs);
    for (int i = 0; i < pool_threads(m->pool); i++) {
        RobotPhases *phases = &m->phases[i];
        *physics += phases->smooth + phases->map + phases->ground + phases->finish;
        *ground += phases->ground;
        memset(phases, 0, sizeof *phases);
    }
}

static EnvsMemory memory(const Envs *envs) {
    const Mujoco *m = own_const(envs);
    return (EnvsMemory){.task = m->stride, .rest = sizeof *m->result};
}

/* ---- state ---- */

static char *state(Envs *envs, size_t *bytes) {
    Mujoco *m = own(envs);
    *bytes = (size_t)m->base.count * m->stride;
    return m->state;
}

static MildStatus save_progress(Envs *envs, TaskProgress *progress, MildError *error) {
    const Mujoco *m = own(envs);
    (void)error;
    for (int i = 0; i < m->base.count; i++) {
        progress[i] = task_progress(env_at(m, i));
    }
    return MILD_OK;
}

static MildStatus load_progress(Envs *envs, const TaskProgress *progress, MildError *error) {
    const Mujoco *m = own(envs);
    (void)error;
    for (int i = 0; i < m->base.count; i++) {
        task_set_progress(env_at(m, i), progress[i]);
    }
    return MILD_OK;
}

static const EnvsBackend backend = {.destroy = destroy,
                                    .reset = reset,
                                    .step = step,
                                    .wait = wait,
                                    .sums = sums,
                                    .save_progress = save_progress,
                                    .load_progress = load_progress,
                                    .memory = memory,
                                    .set_commands = set_commands,
                                    .set_samples = set_samples,
                                    .times = times,
                                    .state = state,
                                    .env = env_of};

Envs *envs_create_mujoco(const EnvsDef *def, MildError *error) {
    if (task_def_check_robot(def->task, def->robot, error) != MILD_OK) {
        return NULL;
    }
    Mujoco *m = calloc(1, sizeof *m);
    if (!m) {
        mild_fail(error, MILD_ERROR_MEMORY, "environments: out of memory");
        return NULL;
    }
    *m = (Mujoco){.base = {.backend = &backend, .count = def->count},
                  .def = *def->task,
                  .shape = task_shape(def->task, def->robot),
                  .robot = def->robot,
                  .pool = def->pool,
                  .trial = def->trial,
                  .terrain = def->terrain,
                  .drive = def->drive,
                  .ground = def->ground,
                  .stride = task_env_bytes(def->task, def->robot)};
    if (open_arrays(m, error) != MILD_OK || open_sims(m, error) != MILD_OK) {
        destroy(&m->base);
        return NULL;
    }
    init_envs(m, def);
    return &m->base;
}
