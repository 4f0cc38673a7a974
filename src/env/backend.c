#include "env/backend.h"

#include <math.h>

_Static_assert((int)TASK_REWARD_COUNT <= (int)ENVS_TERMS_MAX, "room for every term");

Envs *envs_create(const EnvsDef *def, MildError *error) {
    Envs *envs = def->batch ? envs_create_batch(def, error) : envs_create_mujoco(def, error);
    if (envs) {
        envs->count = def->count;
        envs->physics_steps = (int)(TASK_PERIOD / def->task->physics_dt + 0.5);
    }
    return envs;
}

void envs_destroy(Envs *envs) {
    if (envs) {
        envs->backend->destroy(envs);
    }
}

MildStatus envs_reset(Envs *envs, const EnvsView *first, MildStream stream, MildError *error) {
    return envs->backend->reset(envs, first, stream, error);
}

MildStatus envs_step(Envs *envs, const EnvsStep *step, MildStream stream, MildError *error) {
    return envs->backend->step(envs, step, stream, error);
}

MildStatus envs_wait(Envs *envs, MildError *error) {
    return envs->backend->wait(envs, error);
}

MildStatus envs_sums(Envs *envs, EnvsStats *sums, MildStream stream, MildError *error) {
    return envs->backend->sums(envs, sums, stream, error);
}

EnvsStats envs_means(EnvsStats sums, int count) {
    EnvsStats means = sums;
    means.assist /= count;
    const double ended = means.episodes ? (double)means.episodes : (double)NAN;
    const double lived = means.episodes && !(means.length > 0) ? 1 : means.length;
    for (int i = 0; i < TASK_REWARD_COUNT; i++) {
        means.terms[i] = means.episodes ? means.terms[i] / lived : (double)NAN;
    }
    means.length /= ended;
    means.reward /= ended;
    means.speed_error /= ended;
    return means;
}

void envs_times(Envs *envs, double *physics, double *ground) {
    *physics = *ground = 0;
    if (envs->backend->times) {
        envs->backend->times(envs, physics, ground);
    }
}

static MildStatus need_batch(const char *what, MildError *error) {
    return mild_fail(error, MILD_ERROR_ARGUMENT,
                     "%s: MuJoCo steps these environments; set train.robots = batch", what);
}

size_t envs_block_bytes(const Envs *envs, int own_ground) {
    return envs->backend->block_bytes ? envs->backend->block_bytes(envs, own_ground) : 0;
}

MildStatus envs_save(Envs *envs, int first, int count, void *blocks, MildStream stream,
                     MildError *error) {
    return envs->backend->save ? envs->backend->save(envs, first, count, blocks, stream, error)
                               : need_batch("save", error);
}

MildStatus envs_fork(Envs *envs, const void *blocks, int count, size_t bytes, int own_ground,
                     MildStream stream, MildError *error) {
    return envs->backend->fork
               ? envs->backend->fork(envs, blocks, count, bytes, own_ground, stream, error)
               : need_batch("fork", error);
}

MildStatus envs_read(Envs *envs, const EnvsMotion *motion, MildStream stream, MildError *error) {
    return envs->backend->read ? envs->backend->read(envs, motion, stream, error)
                               : need_batch("read", error);
}

char *envs_state(Envs *envs, size_t *bytes) {
    *bytes = 0;
    return envs->backend->state ? envs->backend->state(envs, bytes) : NULL;
}

MildStatus envs_save_progress(Envs *envs, TaskProgress *progress, MildError *error) {
    return envs->backend->save_progress(envs, progress, error);
}

MildStatus envs_load_progress(Envs *envs, const TaskProgress *progress, MildError *error) {
    return envs->backend->load_progress(envs, progress, error);
}

EnvsMemory envs_memory(const Envs *envs) {
    return envs->backend->memory(envs);
}

size_t envs_robot_bytes(const Envs *envs) {
    const EnvsMemory memory = envs_memory(envs);
    return memory.task + memory.engine + memory.ground + memory.rest;
}

size_t envs_bytes(const Envs *envs) {
    return envs_robot_bytes(envs) * (size_t)envs->count;
}

MildStatus envs_set_commands(Envs *envs, const double *command, MildError *error) {
    return envs->backend->set_commands(envs, command, error);
}

void envs_set_samples(Envs *envs, EnvsSample *sample) {
    envs->backend->set_samples(envs, sample);
}

TaskEnv *envs_env(Envs *envs, int i) {
    return envs->backend->env ? envs->backend->env(envs, i) : NULL;
}

int envs_physics_steps(const Envs *envs) {
    return envs->physics_steps;
}
