#include "envs/envs.h"

#include <stdlib.h>
#include <string.h>

#include "actuator/actuator.h"
#include "config/experiment_keys.h"
#include "train/envs.h"

struct MildEnvs {
    ExperimentDef def;
    Robot *robot;
    Pool *pool;
    MildMap *map;       /* NULL: level ground */
    Actuator *actuator; /* NULL: the joints' PD */
    TaskShape shape;
    TrainEnvs *envs;
};

_Static_assert((int)TASK_REWARD_COUNT <= (int)MILD_ENVS_REWARDS_MAX, "room for every term");

static MildStatus build(MildEnvs *envs, MildError *error) {
    ExperimentDef *def = &envs->def;
    int striped = 0;
    envs->robot = robot_open(def->train.robot, error);
    if (!envs->robot) {
        return error->status;
    }
    experiment_fit_robot(def, envs->robot);
    robot_set_model(envs->robot, (MildModel)def->task.randomize.model);
    envs->shape = task_shape(envs->robot);
    envs->pool = pool_create(def->train.threads);
    if (!envs->pool) {
        return mild_fail(error, MILD_ERROR_MEMORY, "cannot start %d threads", def->train.threads);
    }
    if (train_make_map(def, &envs->map, &striped, error) != MILD_OK) {
        return error->status;
    }
    def->task.map = envs->map;
    def->task.print_tiles = terrain_print_tiles(&def->terrain);
    if (actuator_open(&def->task, envs->robot, &envs->actuator, error) != MILD_OK) {
        return error->status;
    }
    envs->envs =
        train_envs_create(def, striped, envs->robot, envs->pool, def->train.envs, 0, error);
    return envs->envs ? MILD_OK : error->status;
}

/* Networks on a device would not see robots on the CPU. */
static MildStatus check_place(const ExperimentDef *def, MildError *error) {
    return train_device(&def->train) < 0 || train_is_batch(&def->train)
               ? MILD_OK
               : mild_fail(error, MILD_ERROR_ARGUMENT,
                           "train.device = %s with train.robots = mujoco: MuJoCo's robots are on "
                           "the CPU; write train.device = cpu",
                           def->train.device);
}

MildEnvs *mild_envs_open(const char *config, const char *const *overrides, int count,
                         MildError *error) {
    MildError local = {0};
    MildError *cause = error ? error : &local;
    MildEnvs *envs = calloc(1, sizeof *envs);
    if (!envs) {
        mild_fail(cause, MILD_ERROR_MEMORY, "environments: out of memory");
        return NULL;
    }
    envs->def = experiment_def_default();
    MildStatus status = experiment_read(&envs->def, config, overrides, count, cause);
    status = status == MILD_OK ? check_place(&envs->def, cause) : status;
    status = status == MILD_OK ? build(envs, cause) : status;
    if (status != MILD_OK) {
        mild_envs_close(envs);
        return NULL;
    }
    return envs;
}

void mild_envs_close(MildEnvs *envs) {
    if (envs) {
        train_envs_destroy(envs->envs);
        mild_map_destroy(envs->map);
        actuator_destroy(envs->actuator);
        pool_destroy(envs->pool);
        robot_destroy(envs->robot);
        free(envs);
    }
}

MildEnvsShape mild_envs_shape(const MildEnvs *envs) {
    const TaskShape *shape = &envs->shape;
    return (MildEnvsShape){.envs = envs->def.train.envs,
                           .actions = shape->actions,
                           .observation = shape->observation,
                           .frames = TASK_FRAMES,
                           .critic = shape->critic,
                           .estimates = shape->estimates,
                           .rewards = TASK_REWARD_COUNT,
                           .device = train_device(&envs->def.train),
                           .period = TASK_PERIOD,
                           .episode = envs->def.task.episode,
                           .clip = envs->def.task.action_clip};
}

const char *mild_envs_reward_name(int index) {
    return task_reward_names[index];
}

void mild_envs_mirror(const MildEnvs *envs, int *observation_index, float *observation_sign,
                      int *action_index, float *action_sign) {
    const TaskMirror mirror = task_mirror(envs->robot);
    const size_t observation = (size_t)envs->shape.observation,
                 actions = (size_t)envs->shape.actions;
    memcpy(observation_index, mirror.observation_index, observation * sizeof *observation_index);
    memcpy(observation_sign, mirror.observation_sign, observation * sizeof *observation_sign);
    memcpy(action_index, mirror.action_index, actions * sizeof *action_index);
    memcpy(action_sign, mirror.action_sign, actions * sizeof *action_sign);
}

static VecView rows_of(const MildEnvsView *view) {
    return (VecView){view->history, view->critic, view->estimate, view->frame};
}

MildStatus mild_envs_reset(MildEnvs *envs, const MildEnvsView *first, void *stream,
                           MildError *error) {
    const VecView rows = rows_of(first);
    return train_envs_reset_into(envs->envs, &rows, stream, error);
}

MildStatus mild_envs_step(MildEnvs *envs, const MildEnvsStep *step, void *stream,
                          MildError *error) {
    const VecView next = rows_of(&step->next), last = rows_of(&step->last);
    if (last.history || step->terms) {
        MildStatus status =
            train_envs_watch_ends(envs->envs, last.history ? &last : NULL, step->terms, error);
        if (status != MILD_OK) {
            return status;
        }
    }
    return train_envs_step_into(envs->envs, step->action, step->reward, step->done, step->timeout,
                                step->valid, &next, stream, error);
}

MildStatus mild_envs_statistics(MildEnvs *envs, MildEnvsStatistics *statistics, void *stream,
                                MildError *error) {
    VecStats sums;
    MildStatus status = train_envs_take_sums(envs->envs, &sums, stream, error);
    if (status != MILD_OK) {
        return status;
    }
    const VecStats stats = vec_stats_from(sums, envs->def.train.envs);
    *statistics = (MildEnvsStatistics){.episodes = stats.episodes,
                                       .falls = stats.falls,
                                       .diverged = stats.diverged,
                                       .steps = stats.steps,
                                       .paid = stats.paid,
                                       .length = stats.length,
                                       .reward = stats.reward,
                                       .speed_error = stats.speed_error,
                                       .assist = stats.assist};
    memcpy(statistics->terms, stats.terms, sizeof stats.terms);
    return MILD_OK;
}
