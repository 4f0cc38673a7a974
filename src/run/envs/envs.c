#include "run/envs/envs.h"

#include <stdlib.h>
#include <string.h>

#include "run/config/experiment_keys.h"
#include "run/train/experiment.h"

struct MildEnvs {
    ExperimentDef def;
    Robot *robot;
    Pool *pool;
    TaskShape shape;
    TrainEnvs envs;
};

static MildStatus build(MildEnvs *envs, MildError *error) {
    ExperimentDef *def = &envs->def;
    envs->robot = robot_open(def->train.robot, error);
    if (!envs->robot) {
        return error->status;
    }
    if (def->task.scan > 0) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "task.scan = %d: environments for other learners have no height scan; "
                         "leave it out",
                         def->task.scan);
    }
    experiment_fit_robot(def, envs->robot);
    robot_set_model(envs->robot, task_model_soles(def->task.randomize.model));
    robot_set_shells(envs->robot, def->task.shells_stand);
    MildStatus status = task_set_robot(&def->task, envs->robot, error);
    if (status != MILD_OK) {
        return status;
    }
    envs->shape = task_shape(&def->task, envs->robot);
    envs->pool = pool_create(def->train.threads);
    if (!envs->pool) {
        return mild_fail(error, MILD_ERROR_MEMORY, "cannot start %d threads", def->train.threads);
    }
    return train_envs_open(&envs->envs, def, envs->robot, envs->pool, def->train.envs, 0, error);
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
        train_envs_close(&envs->envs);
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
    const TaskMirror mirror = task_mirror(&envs->def.task, envs->robot);
    const size_t observation = (size_t)envs->shape.observation,
                 actions = (size_t)envs->shape.actions;
    memcpy(observation_index, mirror.observation_index, observation * sizeof *observation_index);
    memcpy(observation_sign, mirror.observation_sign, observation * sizeof *observation_sign);
    memcpy(action_index, mirror.action_index, actions * sizeof *action_index);
    memcpy(action_sign, mirror.action_sign, actions * sizeof *action_sign);
}

const char *mild_envs_robot(const MildEnvs *envs) {
    return envs->def.policy.robot;
}

const char *mild_envs_task(const MildEnvs *envs) {
    return envs->def.policy.task;
}

const char *mild_envs_model(const MildEnvs *envs) {
    return robot_model_path(envs->robot);
}

int mild_envs_pose(const MildEnvs *envs, int index, double *qpos, int size) {
    double engine[ROBOT_NQ_MAX];
    const TaskEnv *env = envs_env(envs->envs.envs, index);
    const int count = 7 + robot_joints(envs->robot);
    if (!env || size < count) {
        return 0;
    }
    robot_engine_qpos(envs->robot, env->robot.qpos, engine);
    memcpy(qpos, engine, (size_t)count * sizeof *qpos);
    return count;
}

MildStatus mild_envs_reset(MildEnvs *envs, const EnvsView *first, MildStream stream,
                           MildError *error) {
    return envs_reset(envs->envs.envs, first, stream, error);
}

MildStatus mild_envs_step(MildEnvs *envs, const EnvsStep *step, MildStream stream,
                          MildError *error) {
    return envs_step(envs->envs.envs, step, stream, error);
}

size_t mild_envs_block_bytes(const MildEnvs *envs, int own_ground) {
    return envs_block_bytes(envs->envs.envs, own_ground);
}

MildStatus mild_envs_save(MildEnvs *envs, int first, int count, void *blocks, MildStream stream,
                          MildError *error) {
    return envs_save(envs->envs.envs, first, count, blocks, stream, error);
}

MildStatus mild_envs_fork(MildEnvs *envs, const void *blocks, int count, size_t bytes,
                          int own_ground, MildStream stream, MildError *error) {
    return envs_fork(envs->envs.envs, blocks, count, bytes, own_ground, stream, error);
}

MildStatus mild_envs_read(MildEnvs *envs, const EnvsMotion *motion, MildStream stream,
                          MildError *error) {
    return envs_read(envs->envs.envs, motion, stream, error);
}

MildStatus mild_envs_stats(MildEnvs *envs, EnvsStats *stats, MildStream stream, MildError *error) {
    EnvsStats sums;
    MildStatus status = envs_sums(envs->envs.envs, &sums, stream, error);
    if (status == MILD_OK) {
        *stats = envs_means(sums, envs->def.train.envs);
    }
    return status;
}
