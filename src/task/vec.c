#include "task/vec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "robot/phases.h"

struct Vec {
    TaskDef def;
    TaskShape shape;
    const Robot *robot;
    Pool *pool;
    int envs;
    size_t stride;
    char *state;         /* [envs][stride] TaskEnv and ground memory */
    TaskStep *step;      /* [envs] */
    RobotSim **sim;      /* [threads] */
    RobotPhases *phases; /* [threads] */
    VecStats stats;      /* sums */
    /* arguments of the call in flight */
    const float *action;
    const VecView *view;
    const VecView *last; /* of vec_watch_ends */
    float *terms;
};

static TaskEnv *env_at(const Vec *vec, int i) {
    return (TaskEnv *)(void *)(vec->state + (size_t)i * vec->stride);
}

static float *row_at(float *rows, int i, int width) {
    return rows ? rows + (size_t)i * (size_t)width : NULL;
}

static TaskView view_at(const Vec *vec, const VecView *view, int i) {
    const TaskShape *shape = &vec->shape;
    return (TaskView){
        .history = row_at(view->history, i, shape->history),
        .critic = row_at(view->critic, i, shape->critic),
        .estimate = row_at(view->estimate, i, shape->estimates),
        .frame = row_at(view->frame, i, shape->observation),
    };
}

Vec *vec_create(const TaskDef *def, const Robot *robot, Pool *pool, int envs, uint64_t seed,
                MildError *error) {
    if (task_def_check_robot(def, robot, error) != MILD_OK) {
        return NULL;
    }
    Vec *vec = calloc(1, sizeof *vec);
    if (!vec) {
        mild_fail(error, MILD_ERROR_MEMORY, "environments: out of memory");
        return NULL;
    }
    *vec = (Vec){.def = *def,
                 .shape = task_shape(robot),
                 .robot = robot,
                 .pool = pool,
                 .envs = envs,
                 .stride = task_env_bytes(def, robot)};
    vec->state = aligned_alloc(64, (size_t)envs * vec->stride);
    vec->step = calloc((size_t)envs, sizeof *vec->step);
    vec->sim = calloc((size_t)pool_threads(pool), sizeof(RobotSim *));
    vec->phases = calloc((size_t)pool_threads(pool), sizeof *vec->phases);
    if (!vec->state || !vec->step || !vec->sim || !vec->phases) {
        mild_fail(error, MILD_ERROR_MEMORY, "environments: out of memory for %d", envs);
        vec_destroy(vec);
        return NULL;
    }
    for (int i = 0; i < pool_threads(pool); i++) {
        vec->sim[i] = robot_sim_create(robot, def->physics_dt, error);
        if (!vec->sim[i]) {
            vec_destroy(vec);
            return NULL;
        }
        robot_sim_time_phases(vec->sim[i], &vec->phases[i]);
    }
    for (int i = 0; i < envs; i++) {
        task_env_init(env_at(vec, i), def, robot, seed, (uint32_t)i);
    }
    return vec;
}

void vec_destroy(Vec *vec) {
    if (!vec) {
        return;
    }
    for (int i = 0; vec->sim && i < pool_threads(vec->pool); i++) {
        robot_sim_destroy(vec->sim[i]);
    }
    free(vec->sim);
    free(vec->phases);
    free(vec->step);
    free(vec->state);
    free(vec);
}

void vec_number_from(Vec *vec, int first) {
    for (int i = 0; i < vec->envs; i++) {
        env_at(vec, i)->index = (uint32_t)(first + i);
    }
}

static void reset_piece(void *context, int piece, int thread) {
    Vec *vec = context;
    TaskView view = view_at(vec, vec->view, piece);
    task_env_reset(env_at(vec, piece), &vec->def, vec->robot, vec->sim[thread], &view);
}

void vec_reset(Vec *vec, const VecView *first) {
    vec->view = first;
    pool_run(vec->pool, vec->envs, reset_piece, vec);
}

static void copy_row(const float *from, int width, int valid, float *to) {
    if (from && to) {
        memset(to, 0, (size_t)width * sizeof *to);
        memcpy(to, from, valid ? (size_t)width * sizeof *to : 0);
    }
}

/* The end of an episode is seen where the next observation will be, and copied from there. */
static void keep_last(const Vec *vec, int piece, const TaskView *view) {
    const TaskShape *shape = &vec->shape;
    const TaskView last = view_at(vec, vec->last, piece);
    const int valid = vec->step[piece].valid;
    copy_row(view->history, shape->history, valid, last.history);
    copy_row(view->critic, shape->critic, valid, last.critic);
    copy_row(view->estimate, shape->estimates, valid, last.estimate);
    copy_row(view->frame, shape->observation, valid, last.frame);
}

static void step_piece(void *context, int piece, int thread) {
    Vec *vec = context;
    TaskView view = view_at(vec, vec->view, piece);
    TaskEnv *env = env_at(vec, piece);
    const float *action = vec->action + (size_t)piece * (size_t)vec->shape.actions;
    TaskStep *step = &vec->step[piece];
    *step = task_env_step(env, &vec->def, vec->robot, vec->sim[thread], action, !vec->last, &view,
                          NULL);
    if (step->done && vec->last) {
        keep_last(vec, piece, &view);
        task_env_reset(env, &vec->def, vec->robot, vec->sim[thread], &view);
    }
    if (step->done && vec->terms) {
        memcpy(vec->terms + (size_t)piece * TASK_REWARD_COUNT, step->episode_terms,
               sizeof step->episode_terms);
    }
}

static void count_episode(Vec *vec, const TaskStep *step) {
    VecStats *stats = &vec->stats;
    stats->episodes++;
    stats->falls += !step->timeout;
    stats->length += step->length * TASK_PERIOD;
    stats->reward += (double)step->episode_reward;
    stats->speed_error += (double)step->episode_speed_error;
    for (int i = 0; i < TASK_REWARD_COUNT; i++) {
        stats->terms[i] += (double)step->episode_terms[i];
    }
}

void vec_step(Vec *vec, const float *action, float *reward, uint8_t *done, uint8_t *timeout,
              uint8_t *valid, const VecView *next) {
    vec->action = action;
    vec->view = next;
    pool_run(vec->pool, vec->envs, step_piece, vec);
    for (int i = 0; i < vec->envs; i++) {
        const TaskStep *step = &vec->step[i];
        reward[i] = step->reward;
        done[i] = step->done;
        timeout[i] = step->timeout;
        valid[i] = step->valid;
        vec->stats.diverged += !step->valid;
        vec->stats.paid += (double)step->reward;
        if (step->done) {
            count_episode(vec, step);
        }
    }
    vec->stats.steps += vec->envs;
    vec_watch_ends(vec, NULL, NULL);
}

void vec_watch_ends(Vec *vec, const VecView *last, float *terms) {
    vec->last = last;
    vec->terms = terms;
}

VecStats vec_take_sums(Vec *vec) {
    VecStats sums = vec->stats;
    for (int i = 0; i < vec->envs; i++) {
        sums.assist += task_assist_share(env_at(vec, i), &vec->def);
    }
    memset(&vec->stats, 0, sizeof vec->stats);
    return sums;
}

VecStats vec_stats_from(VecStats sums, int envs) {
    VecStats stats = sums;
    stats.assist /= envs;
    const double ended = stats.episodes ? (double)stats.episodes : (double)NAN;
    const double lived = stats.episodes && !(stats.length > 0) ? 1 : stats.length;
    for (int i = 0; i < TASK_REWARD_COUNT; i++) {
        stats.terms[i] = stats.episodes ? stats.terms[i] / lived : (double)NAN;
    }
    stats.length /= ended;
    stats.reward /= ended;
    stats.speed_error /= ended;
    return stats;
}

VecStats vec_take_stats(Vec *vec) {
    return vec_stats_from(vec_take_sums(vec), vec->envs);
}

void vec_take_times(Vec *vec, double *physics, double *ground) {
    *physics = *ground = 0;
    for (int i = 0; i < pool_threads(vec->pool); i++) {
        RobotPhases *phases = &vec->phases[i];
        *physics += phases->smooth + phases->map + phases->ground + phases->finish;
        *ground += phases->ground;
        memset(phases, 0, sizeof *phases);
    }
}

void *vec_state(Vec *vec, size_t *bytes) {
    *bytes = (size_t)vec->envs * vec->stride;
    return vec->state;
}

void vec_keep(const Vec *vec, TaskKept *kept) {
    for (int i = 0; i < vec->envs; i++) {
        kept[i] = task_keep(env_at(vec, i));
    }
}

void vec_restore(Vec *vec, const TaskKept *kept) {
    for (int i = 0; i < vec->envs; i++) {
        task_restore(env_at(vec, i), kept[i]);
    }
}

size_t vec_bytes(const Vec *vec) {
    return (size_t)vec->envs * (vec->stride + sizeof *vec->step);
}

static uint64_t hash_bytes(uint64_t hash, const void *data, size_t size) {
    const unsigned char *bytes = data;
    for (size_t i = 0; i < size; i++) {
        hash = (hash ^ bytes[i]) * 0x100000001b3u;
    }
    return hash;
}

/* Hashes member by member, because padding and entries beyond the robot's joints are not part of
 * the state. */
uint64_t vec_hash(const Vec *vec) {
    uint64_t hash = 0xcbf29ce484222325u;
    for (int i = 0; i < vec->envs; i++) {
        TaskEnv *env = env_at(vec, i);
        size_t joints = (size_t)vec->shape.joints, speeds = (6 + joints) * sizeof(double);
        hash = hash_bytes(hash, env->robot.qpos, (7 + joints) * sizeof(double));
        hash = hash_bytes(hash, env->robot.qvel, speeds);
        hash = hash_bytes(hash, env->robot.qacc, speeds);
        hash = hash_bytes(hash, task_env_history(env), (size_t)vec->shape.history * sizeof(float));
        hash = hash_bytes(hash, env->command, sizeof env->command);
        hash = hash_bytes(hash, &env->reward_sum, sizeof env->reward_sum);
        hash = hash_bytes(hash, task_env_ground(env), mild_ground_size(task_env_ground(env)));
        hash = hash_bytes(hash, task_env_motors(env), vec->def.motors ? vec->def.motors->bytes : 0);
    }
    return hash;
}
