#include "train/envs.h"

#include <stdlib.h>

#include "crowd/crowd.h"
#include "device/device.h"

enum { TRAIN_MATERIALS = 3 }; /* drawn for the pattern of a terrain, as for stripes */

struct TrainEnvs {
    Vec *vec;     /* or */
    Crowd *crowd; /* the other is NULL */
    int device;   /* of the crowd */
    PolicyDef policy;
};

/* The batch engine has patches as stripes of the map. */
MildStatus train_make_map(const ExperimentDef *def, MildMap **map, int *striped, MildError *error) {
    *striped = train_is_batch(&def->train) && def->task.randomize.patch_share > 0 &&
               def->terrain.map.patches == MILD_PATTERN_NONE;
    return *striped
               ? terrain_make_striped(&def->terrain, TRAIN_MATERIALS,
                                      def->task.randomize.patch_length, def->train.seed, map, error)
               : terrain_make(&def->terrain, TRAIN_MATERIALS, map, error);
}

static int make(TrainEnvs *envs, const ExperimentDef *def, int striped, const Robot *robot,
                Pool *pool, int count, int first, MildError *error) {
    envs->policy = def->policy;
    envs->device = train_device(&def->train);
    if (!train_is_batch(&def->train)) {
        envs->vec = vec_create(&def->task, robot, pool, count, def->train.seed, error);
        if (envs->vec) {
            vec_number_from(envs->vec, first);
        }
        return envs->vec != NULL;
    }
    const CrowdDef crowd = {.task = &def->task,
                            .robot = robot,
                            .pool = pool,
                            .device = envs->device < 0 ? DEVICE_HOST : envs->device,
                            .envs = count,
                            .first = (uint32_t)first,
                            .grounds = def->train.grounds,
                            .seed = def->train.seed,
                            .striped = striped};
    envs->crowd = crowd_create(&crowd, error);
    return envs->crowd != NULL;
}

TrainEnvs *train_envs_create(const ExperimentDef *def, int striped, const Robot *robot, Pool *pool,
                             int count, int first, MildError *error) {
    TrainEnvs *envs = calloc(1, sizeof *envs);
    if (!envs) {
        mild_fail(error, MILD_ERROR_MEMORY, "environments: out of memory");
        return NULL;
    }
    if (!make(envs, def, striped, robot, pool, count, first, error)) {
        free(envs);
        return NULL;
    }
    return envs;
}

void train_envs_destroy(TrainEnvs *envs) {
    if (envs) {
        vec_destroy(envs->vec);
        crowd_destroy(envs->crowd);
        free(envs);
    }
}

static VecView view_of(const TrainEnvs *envs, const PpoBatch *batch, int t) {
    const PolicyDef *policy = &envs->policy;
    const size_t row = (size_t)t * (size_t)batch->envs;
    return (VecView){
        .history = batch->history + row * (size_t)(policy->frames * policy->observation),
        .critic = batch->critic + row * (size_t)policy->critic_input,
        .estimate = batch->target + row * (size_t)policy->estimates,
        .frame = batch->frame + row * (size_t)policy->observation,
    };
}

MildStatus train_envs_reset_into(TrainEnvs *envs, const VecView *first, void *stream,
                                 MildError *error) {
    if (envs->crowd) {
        return crowd_reset(envs->crowd, first, stream, error);
    }
    vec_reset(envs->vec, first);
    return MILD_OK;
}

MildStatus train_envs_step_into(TrainEnvs *envs, const float *action, float *reward, uint8_t *done,
                                uint8_t *timeout, uint8_t *valid, const VecView *next, void *stream,
                                MildError *error) {
    if (envs->crowd) {
        return crowd_step(envs->crowd, action, reward, done, timeout, valid, next, stream, error);
    }
    vec_step(envs->vec, action, reward, done, timeout, valid, next);
    return MILD_OK;
}

MildStatus train_envs_watch_ends(TrainEnvs *envs, const VecView *last, float *terms,
                                 MildError *error) {
    if (envs->crowd) {
        return mild_fail(error, MILD_ERROR_ARGUMENT,
                         "the batch engine does not tell how an episode ends; train.robots = "
                         "mujoco does");
    }
    vec_watch_ends(envs->vec, last, terms);
    return MILD_OK;
}

MildStatus train_envs_reset(TrainEnvs *envs, PpoBatch *batch, void *stream, MildError *error) {
    const VecView first = view_of(envs, batch, 0);
    return train_envs_reset_into(envs, &first, stream, error);
}

MildStatus train_envs_step(TrainEnvs *envs, PpoBatch *batch, int t, void *stream,
                           MildError *error) {
    const size_t row = (size_t)t * (size_t)batch->envs;
    const float *action = batch->action + row * (size_t)envs->policy.actions;
    const VecView next = view_of(envs, batch, t + 1);
    return train_envs_step_into(envs, action, batch->reward + row, batch->done + row,
                                batch->timeout + row, batch->valid + row, &next, stream, error);
}

MildStatus train_envs_wait(const TrainEnvs *envs, MildError *error) {
    return envs->crowd ? device_wait(envs->device, error) : MILD_OK;
}

MildStatus train_envs_take_sums(TrainEnvs *envs, VecStats *sums, void *stream, MildError *error) {
    if (envs->crowd) {
        return crowd_take_sums(envs->crowd, sums, stream, error);
    }
    *sums = vec_take_sums(envs->vec);
    return MILD_OK;
}

void train_envs_take_times(TrainEnvs *envs, double *physics, double *ground) {
    *physics = *ground = 0;
    if (envs->vec) {
        vec_take_times(envs->vec, physics, ground);
    }
}

size_t train_envs_bytes(const TrainEnvs *envs) {
    return envs->crowd ? crowd_bytes(envs->crowd) : vec_bytes(envs->vec);
}

void *train_envs_state(TrainEnvs *envs, size_t *bytes) {
    *bytes = 0;
    return envs->vec ? vec_state(envs->vec, bytes) : NULL;
}

MildStatus train_envs_keep(TrainEnvs *envs, TaskKept *kept, MildError *error) {
    if (envs->crowd) {
        return crowd_keep(envs->crowd, kept, error);
    }
    vec_keep(envs->vec, kept);
    return MILD_OK;
}

MildStatus train_envs_restore(TrainEnvs *envs, const TaskKept *kept, MildError *error) {
    if (envs->crowd) {
        return crowd_restore(envs->crowd, kept, error);
    }
    vec_restore(envs->vec, kept);
    return MILD_OK;
}
